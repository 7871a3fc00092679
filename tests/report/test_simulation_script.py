"""The page computes what Python computes: the register machine for every system, and augmented systems."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from tests.diagnosis.diagnoses import Said, added_to, diagnosis, known, told
from tests.diagnosis.test_stores import CELL, record
from tests.machines.folders import system_of
from tests.physics.kernel.random_systems import random_structure
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.answer.live import live
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.effects.actuator_gain import ActuatorGain
from unmodelled.effects.added import Added
from unmodelled.effects.backlash import FrictionBehindPlay
from unmodelled.effects.delay import InputDelay, SensorDelay
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.effects.sensor_gain import SensorGain
from unmodelled.effects.sensor_lag import SensorLag
from unmodelled.engine.free_run import Integration, Windows, free_run
from unmodelled.engine.machine.javascript import as_data, as_text
from unmodelled.engine.machine.opcodes import Op
from unmodelled.engine.machine.program import Program
from unmodelled.logs.folder import read_logs
from unmodelled.report.rendering import STATIC
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

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


ROOT = Path(__file__).parents[2] / "systems"
#: System files; some files of this folder are no systems.
FILES = [path for path in sorted(ROOT.glob("**/*.yaml")) if "schema: system/1" in path.read_text()]
SAMPLES, RANDOM = 120, 60

FREE_RUN = """([data, u, t, p, c, x0, how]) => {
  const [program, given] = [machine.loaded(data), u.map(machine.numbers)];
  const windows = { u: given, t: machine.numbers(t), start: 3, steps: t_length - 4 };
  const found = machine.simulate(program, windows, ...[p, c, x0].map(machine.numbers), how);
  return found.map((y) => [...y].map(String));
}"""
AT = """([data, ...given]) => {
  const [x, u, p, c] = given.map(machine.numbers);
  return machine.evaluate(machine.loaded(data), 0.3, x, u, p, c).map(String);
}"""


def random_systems() -> Iterator[System]:
    for seed in range(RANDOM):
        try:
            yield random_structure(seed).system
        except BadInput:  # not every draw is a system
            continue


def drawn(system: System, seed: int) -> tuple[Array, Array, Array, Array]:
    """Inputs (samples, inputs), parameters, constants and states near those of the file."""
    draw = np.random.default_rng(seed).normal
    t = np.arange(SAMPLES)[:, None] / SAMPLES
    u = np.sin(7.0 * t + draw(size=len(system.u))) + 0.1 * draw(size=(SAMPLES, len(system.u)))
    p = np.array(system.values) * (1.0 + 0.05 * draw(size=len(system.p)))
    return u, p, 1.0 + 0.1 * draw(size=len(system.c)), 0.3 * draw(size=len(system.x))


def in_browser(page: Page, program: Program, given: tuple[Array, ...], t: Array, how: Integration) -> Array:
    u, p, c, x0 = given
    hold = list(how.hold) if isinstance(how.hold, tuple) else [how.hold] * u.shape[1]
    numbers = [as_text(t), *(as_text(values) for values in (p, c, x0))]
    settings = {"period": how.period, "substeps": how.substeps, "hold": hold}
    columns = [as_text(column) for column in u.T]
    script = FREE_RUN.replace("t_length", str(len(t)))
    found: Any = page.evaluate(script, [as_data(program), columns, *numbers, settings])
    return np.array(found, np.float64).T


def assert_equal(page: Page, system: System, seed: int) -> None:
    """Free runs are equal to 1e-9 of the largest value, as long as they stay finite."""
    program = Program.of(system, [*system.x, *(output.expression for output in system.outputs)])
    u, p, c, x0 = drawn(system, seed)
    hold = tuple(float((seed + k) % 2) for k in range(u.shape[1]))
    how = Integration(2e-4, "rk4", 1 + seed % 3, hold)
    t, one = how.period * np.arange(SAMPLES), np.ones(1, np.int64)
    windows = Windows(u, t, 3 * one, (SAMPLES - 4) * one, 0 * one, 0 * one)
    with np.errstate(all="ignore"):
        expected = free_run(program, windows, p[None, None], c[None], x0[None, None], how)[0, 0]
        found = in_browser(page, program, (u, p, c, x0), t, how)
    assert found.shape == expected.shape
    for measured, shown in zip(expected.T, found.T, strict=True):
        assert (np.isfinite(measured) == np.isfinite(shown)).all()
        seen = np.isfinite(measured)
        scale = np.abs(measured[seen]).max(initial=1e-3)
        assert (np.abs(measured - shown)[seen] <= 1e-9 * scale).all()


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_every_system_file_runs_as_in_python(path: Path, page: Page) -> None:
    assert_equal(page, read_system(path), len(path.stem))


@pytest.mark.long
def test_random_systems_run_as_in_python(page: Page) -> None:
    used: set[int] = set()
    for seed, system in enumerate(random_systems()):
        assert_equal(page, system, seed)
        used |= set(Program.of(system, system.x).code[:, 0].tolist())
    assert {Op(code) for code in used} == set(Op)


def test_values_at_one_state(page: Page) -> None:
    system = read_system(ROOT / "slider_crank.yaml")
    program = Program.of(system, system.dynamics)
    u, p, c, x0 = drawn(system, 5)
    expected = program.evaluate(np.array(0.3), x0, u[0], p, c)
    found = page.evaluate(AT, [as_data(program), *map(as_text, (x0, u[0], p, c))])
    np.testing.assert_allclose(np.array(found, np.float64), expected, rtol=1e-12)


@pytest.mark.long
def test_other_instructions_are_refused(page: Page) -> None:
    system = read_system(ROOT / "pendulum.yaml")
    program = Program.of(system, system.dynamics)
    code = program.code.copy()
    code[:, 0] = len(Op)
    given = map(as_text, ([0.1, 0.0], [0.0], system.values, []))
    with pytest.raises(Exception, match=f"no instruction {len(Op)}"):
        page.evaluate(AT, [as_data(program._replace(code=code)), *given])
