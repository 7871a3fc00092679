"""Held-out experiments doubt what the others named, and notes say what else an answer may mean."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis.benches import Bench
from tests.diagnosis.diagnoses import Said, diagnosis, told
from tests.diagnosis.studies import HORIZON, study
from tests.machines.folders import Array, logs_of, motion, recorded, system_of, text_of
from unmodelled.diagnosis.answer import confirmed as module
from unmodelled.diagnosis.answer.confirmed import confirmed, small_effects
from unmodelled.diagnosis.answer.moved_lags import with_moved_lags
from unmodelled.diagnosis.answer.shorter_windows import shorter_windows
from unmodelled.diagnosis.data.gap import FreeRun, Gap
from unmodelled.diagnosis.data.result import Verdict
from unmodelled.diagnosis.decide.decision import is_confirmed
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.effects.place import Place
from unmodelled.logs.folder import read_logs

#: What the search says meanwhile.
LINES: list[str] = []
quiet = LINES.append


@pytest.mark.long
def test_a_gain_of_the_fitted_experiments_alone_is_in_doubt(tmp_path: Path) -> None:
    """In the held-out experiments, the supply is that of the file."""
    runs = 8
    bare = study(tmp_path / "bare", Bench(runs=runs, samples=300))
    supply = tuple(1.0 if k in bare.held_out else 0.7 for k in range(runs))
    found = confirmed(study(tmp_path / "low", Bench(runs=runs, samples=300, supply=supply)), 1, quiet)
    assert "actuator_gain" in [e.family for e in found.chosen.hypothesis.effects]
    (doubt,) = [
        note for note in found.notes if "the held-out experiments are hardly predicted better" in note
    ]
    assert "actuator_gain at actuator:torque" in doubt
    gaps = found.reidentified.gap, judged_model("", found.chosen).gap
    assert not is_confirmed(found.chosen.hypothesis, *gaps)


@pytest.mark.long
def test_an_effect_that_explains_too_little_is_not_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = confirmed(study(tmp_path, Bench(samples=300)), 1, quiet)
    assert [e.family for e in found.chosen.hypothesis.effects] == ["coulomb_friction"] and not found.notes
    monkeypatch.setattr(module, "SMALLEST_SHARE", 1.1)
    chosen, small = module._of_size(found.search, found.chosen)
    assert not chosen.hypothesis.effects and [e.family for e in small] == ["coulomb_friction"]
    (note,) = small_effects(small, ())
    assert note.startswith("coulomb_friction at joint lowers the squared error of all experiments by less")
    assert small_effects(small, small) == []  # what is named, or listed as its equal, is not struck


@pytest.mark.parametrize(
    ("without", "errors", "share"),
    [
        ((0.02, 0.01), (0.01, 0.01), 0.75),  # of what a larger effect leaves
        ((0.1, 1.0), (0.05, 1.0), 0.75),  # in one output, which is a small part of all
        ((0.0, 1.0), (0.3, 0.6), 0.64),  # an output without a gap
        ((0.0, 0.0), (0.1, 0.1), 0.0),  # a channel that repeats its motion exactly
    ],
)
def test_an_effect_explains_a_share_of_the_output_where_it_is_largest(
    without: tuple[float, ...], errors: tuple[float, ...], share: float
) -> None:
    assert module._share(_gap(without), _gap(errors)) == pytest.approx(share)


def _gap(errors: tuple[float, ...]) -> Gap:
    """A gap with these errors of the outputs; nothing else of it counts."""
    run = FreeRun(np.empty((0, 2)), np.empty((0, 2), np.bool_), np.empty(0, np.int64))
    outputs = dict(zip("ab", errors, strict=True))
    value = float(np.sqrt(np.mean(np.square(errors))))
    return Gap(value, {}, outputs, 0.0, {}, 1.0, dict.fromkeys("ab", 1.0), {}, 1, run, ())


@pytest.mark.long
def test_an_effect_that_is_too_small_to_be_named_is_said_with_its_numbers(tmp_path: Path) -> None:
    found = confirmed(study(tmp_path, Bench(friction=0.004, samples=300, noise=2e-5)), 1, quiet)
    assert not found.chosen.hypothesis.effects
    (note,) = found.notes
    said = re.fullmatch(r"coulomb_friction at joint \(F_c = (\S+) N m\) lowers the error .*", note)
    assert said and float(said[1]) == pytest.approx(0.004, rel=0.05)


@pytest.mark.long
def test_a_number_of_single_experiments_that_is_too_small_to_be_named_is_said(tmp_path: Path) -> None:
    supply = (1.006, 0.994, 1.004, 0.996, 1.001, 0.998)
    bench = Bench(friction=0.0, supply=supply, runs=len(supply), samples=300, noise=2e-5)
    found = confirmed(study(tmp_path, bench), 1, quiet)
    assert not found.chosen.hypothesis.effects
    (note,) = found.notes
    assert note.startswith("scatter (gain) at actuator:torque (fitted per experiment) lowers the error ")


DRIVE, SPEED = Place("actuator", "U"), Place("sensor", "w")
ENDS = {"sensor_lag": (SPEED, "T_y", "c_y"), "actuator_lag": (DRIVE, "T_u", "c_u")}


@pytest.mark.parametrize(("dry", "linear"), [(0.0, True), (2.0, False)])
@pytest.mark.parametrize("family", ENDS)
def test_the_other_end_is_listed_where_it_predicts_as_well(
    family: str, dry: float, linear: bool, tmp_path: Path
) -> None:
    """The planted fan has a drive or a sensor with a lag of 0.06 s."""
    of_sensor = family == "sensor_lag"

    def rates(x: Array, volts: Array) -> list[Array]:
        w, lag = x
        torque = 0.6 * (volts if of_sensor else lag) - 0.2 * w - dry * np.tanh(w / 0.01)
        return [torque / 0.05, ((w if of_sensor else volts) - lag) / 0.06]

    def run(rng: np.random.Generator) -> pd.DataFrame:
        U = np.repeat(rng.uniform(-6.0, 6.0, 15), 20)
        seen = motion(rates, [0.0, 0.0], U, 0.01, substeps=20, held=True)[:, int(of_sensor)]
        noisy = seen + 0.02 * rng.standard_normal(len(U))
        return pd.DataFrame({"t": 0.01 * np.arange(len(U)), "U": U, "w": noisy})

    system = system_of(text_of("fan.yaml", ("F: {value: 0.1", f"F: {{value: {dry}")), tmp_path)
    logs = read_logs(recorded(tmp_path / "logs", run, 4, 5), system)
    place, time, switch = ENDS[family]
    before = told(system, logs, Said(family, place, {time: 0.06, switch: 1.0}))
    (effect,) = with_moved_lags(before).effects
    (other,) = {*ENDS} - {family}
    sites = {found.site for found in effect.indistinguishable}
    assert ((other, ENDS[other][0].channel) in sites) is linear


def test_other_effects_stay_as_they_are(tmp_path: Path) -> None:
    t = 0.01 * np.arange(200)
    table = pd.DataFrame({"t": t, "U": np.sin(3.0 * t), "w": np.sin(3.0 * t - 0.5)})
    system = system_of(text_of("fan.yaml"), tmp_path)
    logs = logs_of(system, tmp_path / "logs", [table] * 4)
    before = told(system, logs, Said("viscous_friction", Place("port", "shaft"), {"d": 0.1}))
    assert with_moved_lags(before) is before


DAMPING = Said("viscous_friction", Place("port", "joint"), {"d": 0.002})


@pytest.mark.parametrize(
    ("verdict", "shrink", "horizon", "advised"),
    [
        *(("main_effect", 0.3, HORIZON, "horizon=0.017"), ("unknown", 0.0, HORIZON, "horizon=0.017")),
        *(("main_effect", 0.8, HORIZON, ""), ("effect", 0.3, HORIZON, ""), ("unknown", 0.0, 0.02, "")),
    ],
)
def test_most_of_the_gap_is_left(
    verdict: Verdict, shrink: float, horizon: float, advised: str, tmp_path: Path
) -> None:
    found = replace(diagnosis(tmp_path, DAMPING), verdict=verdict, shrink=shrink, horizon=horizon)
    notes = list(shorter_windows(found))
    assert [advised in note for note in notes] == [True] * bool(advised)


def test_a_port_without_a_position_has_no_travel(tmp_path: Path) -> None:
    found = replace(diagnosis(tmp_path, DAMPING), verdict="unknown", shrink=0.0)
    (port,) = found.system.ports
    still = replace(found.system, ports=(replace(port, position=None),))
    assert not list(shorter_windows(replace(found, system=still)))
