"""The page simulates augmented systems as the diagnosis does, over windows and over whole experiments."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page

from tests.diagnosis.diagnoses import Said, added_to, diagnosis, known, told
from tests.diagnosis.test_stores import CELL, record
from tests.machines.folders import system_of
from unmodelled.diagnosis.answer.live import live
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.effects.actuator_gain import ActuatorGain
from unmodelled.effects.added import Added
from unmodelled.effects.backlash import FrictionBehindPlay
from unmodelled.effects.effect import Effect
from unmodelled.effects.input_delay import InputDelay
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.effects.sensor_delay import SensorDelay
from unmodelled.effects.sensor_gain import SensorGain
from unmodelled.effects.sensor_lag import SensorLag
from unmodelled.logs.folder import read_logs
from unmodelled.report.rendering import STATIC

Array = NDArray[np.float64]

RUN = """([k, kind, steps]) => {
  const e = window.LOADED.experiments[k];
  const run = simulation.run(window.LOADED, e, { ...window.LOADED[kind], c: e[kind] }, steps ?? Infinity);
  return run.outputs.map((values) => [...values].map(String));
}"""
#: Alone and together; the first ones delay what others are read from.
TOGETHER: list[list[Effect]] = [
    [InputDelay(), SensorDelay(), FrictionBehindPlay()],
    [SensorDelay(), SensorGain(), ActuatorGain()],
    [SensorDelay(), SensorLag()],
]


@pytest.fixture(scope="module")
def page(browser: Browser) -> Iterator[Page]:
    with browser.new_context() as context:
        opened = context.new_page()
        for script in (STATIC / "machine.js", STATIC / "simulation.js"):
            opened.add_script_tag(content=script.read_text())
        yield opened


def said(folder: Path, together: list[Effect]) -> list[Said]:
    """Effects at their first places: amplitudes of a plausible size, shapes off the samples and grids."""
    system, logs = known(folder)
    places = [effect.places(system)[0] for effect in together]
    bare = [Said(e.family, place, {}, e.variant) for e, place in zip(together, places, strict=True)]
    found = added_to(system, logs, bare)
    return [replace(s, **numbers(added, len(logs))) for s, added in zip(bare, found, strict=True)]


def numbers(added: Added, count: int) -> dict[str, Any]:
    amplitudes = {n: 1.0 if n in added.shares else 0.3 * added.scales[n] for n in added.amplitudes}
    shapes = {n: 0.9 * grid[len(grid) // 2] for n, grid in added.shapes.items()}
    shapes |= {n: 2.3 * added.scales[n] for n in added.delays}
    every = {n: float(np.clip(v, *added.bounds[n])) for n, v in (amplitudes | shapes).items()}
    own = {n: (every.pop(n) * np.linspace(-1.0, 1.0, count)).tolist() for n in added.per_experiment}
    return {"numbers": every, "own": own}


def simulated(diagnosis: Diagnosis, model: JudgedModel, substeps: int, whole: bool) -> Array:
    """Outputs of all samples as delayed sensors show them; nan where nothing is simulated."""
    latest = max(output.delay for output in model.system.outputs)
    if whole:
        recording = Recording.whole(model.logs, latest=latest)
    else:
        recording = Recording.of(model.logs, diagnosis.horizon, latest=latest)
    simulation = Simulation(model.system, recording)
    values = simulation.values[None, None]
    found, seen = simulation(values, substeps=substeps), recording.counted
    y = np.full(model.logs.y.shape, np.nan)
    for j, late in enumerate(simulation.later(values[0])[0]):
        y[recording.rows[seen] + late, j] = found.y[:, 0][seen][:, j]
    return y


def assert_same_runs(page: Page, found: Diagnosis) -> None:
    """Equal to 1e-9 of the largest value, before and after, over windows and whole experiments."""
    data: dict[str, Any] = live(found, {})
    page.evaluate("(data) => { window.LOADED = simulation.loaded(data); }", data)
    assert len(data["experiments"]) == len(found.logs)
    models = {"given": found.known, "identified": found.augmented}
    for (kind, model), steps in ((m, s) for m in models.items() for s in (data["steps"], None)):
        expected = simulated(found, model, data["substeps"], whole=steps is None)
        for k, experiment in enumerate(data["experiments"]):
            shown = np.array(page.evaluate(RUN, [k, kind, steps]), np.float64).T
            wanted = expected[found.logs.rows(found.logs.ids.index(experiment["id"]))]
            seen = np.isfinite(wanted)
            assert seen.any() and (np.isfinite(shown) == seen).all()
            assert (np.abs(shown - wanted)[seen] <= 1e-9 * np.abs(wanted[seen]).max()).all()


@pytest.mark.parametrize("together", TOGETHER, ids=lambda each: " ".join(e.family for e in each))
def test_effects_together(together: list[Effect], tmp_path: Path, page: Page) -> None:
    assert_same_runs(page, diagnosis(tmp_path, *said(tmp_path, together), timing=0.0004))


def test_a_state_that_an_output_shows_beside_a_memory(tmp_path: Path, page: Page) -> None:
    system = system_of(CELL, tmp_path)
    logs = read_logs(record(tmp_path / "logs", (0.5, 0.6, 0.7, 0.8)), system)
    branch = Said("rc_branch", Place("sensor", "v"), {"R_1": -0.018, "tau_1": 40.0})
    assert_same_runs(page, told(system, logs, branch))


@pytest.mark.long
def test_every_effect_of_a_drive(tmp_path: Path, page: Page) -> None:
    """Memory, delays, numbers of single experiments and slopes beyond the data are among them."""
    system, _ = known(tmp_path)
    alone = [[e] for e in effects() if not e.beside and e.places(system)]
    found = [diagnosis(tmp_path, *said(tmp_path, effect)) for effect in alone]
    for each in found:
        assert_same_runs(page, each)
    added = [each.effects[0].added for each in found]
    assert len(added) > 25
    for what in ("memory", "delays", "per_experiment", "slopes", "columns", "shares"):
        assert any(getattr(one, what) for one in added), what
