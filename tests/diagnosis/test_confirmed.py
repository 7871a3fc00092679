"""Held-out experiments confirm what the others named, and notes say what else an answer may mean."""

import re
from collections.abc import Sequence
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
from unmodelled.diagnosis.answer.confirmed import MOST_REFUSED, _is_lower, _refused, confirmed, refusals
from unmodelled.diagnosis.answer.moved_lags import with_moved_lags
from unmodelled.diagnosis.answer.shorter_windows import shorter_windows
from unmodelled.diagnosis.data.gap import FreeRun, Gap
from unmodelled.diagnosis.data.result import Verdict
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.effects.added import Added
from unmodelled.effects.place import Place
from unmodelled.logs.folder import read_logs

#: What the search says meanwhile.
LINES: list[str] = []
quiet = LINES.append


@pytest.mark.long
def test_a_gain_of_the_fitted_experiments_alone_is_refused(tmp_path: Path) -> None:
    """In the held-out experiments, the supply is that of the file."""
    runs = 8
    bare = study(tmp_path / "bare", Bench(runs=runs, samples=300))
    supply = tuple(1.0 if k in bare.held_out else 0.7 for k in range(runs))
    found = confirmed(study(tmp_path / "low", Bench(runs=runs, samples=300, supply=supply)), 1, quiet)
    assert "actuator_gain" not in [e.family for e in found.chosen.hypothesis.effects]
    refusal = "actuator_gain at actuator:torque predicts the fitted experiments better"
    assert [note for note in refusals(found.refused, ()) if note.startswith(refusal)]
    fitted = [e.family for f in found.search.candidates.fits for e in f.hypothesis.effects]
    assert "actuator_gain" not in fitted


@pytest.mark.long
def test_the_best_without_refused_is_judged_next(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[str] = []

    def refuse(search: EffectSearch, named: FittedHypothesis, before: Gap) -> Sequence[Added]:
        judged.append(" ".join(f"{e.family} {e.variant}".strip() for e in named.hypothesis.effects))
        return named.hypothesis.effects if len(judged) < 2 else ()

    monkeypatch.setattr(module, "_refused", refuse)
    found = confirmed(study(tmp_path, Bench(samples=300)), 1, quiet)
    assert judged[0] == "coulomb_friction" != judged[1] and len(judged) == 2
    assert [e.family for e in found.chosen.hypothesis.effects] == judged[1].split()[:1]
    (note,) = refusals(found.refused, ())
    assert note.startswith(
        "coulomb_friction at joint predicts the fitted experiments better, but not the held"
    )


@pytest.mark.long
def test_a_model_that_is_hardly_better_than_none_names_nothing(tmp_path: Path) -> None:
    found = confirmed(study(tmp_path, Bench(samples=300)), 1, quiet)
    gap = judged_model("", found.chosen).gap
    assert found.chosen.hypothesis.effects
    for share, named in ((1.1, True), (0.9, False)):
        limits = replace(DEFAULT_THRESHOLDS, useful_error=share * gap.value / gap.persistence)
        search = EffectSearch(replace(found.search.study, thresholds=limits), 1)
        chosen = FittedHypothesis.of(found.chosen.hypothesis, search.fitted, [found.chosen.fit.every])
        assert bool(_refused(search, chosen, found.reidentified.gap)) != named


@pytest.mark.long
def test_nothing_is_named_after_some_refusals(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[FittedHypothesis] = []

    def refuse(search: EffectSearch, named: FittedHypothesis, before: Gap) -> Sequence[Added]:
        judged.append(named)
        return named.hypothesis.effects

    monkeypatch.setattr(module, "_refused", refuse)
    found = confirmed(study(tmp_path, Bench(samples=300)), 1, quiet)
    assert not found.chosen.hypothesis.effects and judged[-1] is found.chosen
    notes = refusals(found.refused, ())
    assert len(judged) > MOST_REFUSED and len(notes) == len(set(notes)) > 0
    # what is named, or listed as its equal, is not refused
    assert refusals(found.refused, found.refused) == []


@pytest.mark.parametrize(
    ("errors", "without", "lower"),
    [
        ((0.3, 0.3), (0.3, 0.31), False),  # by less than two percent
        ((0.3, 0.3), (0.3, 0.32), True),
        ((0.05, 1.0), (0.1, 1.0), True),  # in one output, which is a small part of all
        ((0.05, 1.0), (0.06, 0.8), False),  # but not on average over the outputs
    ],
)
def test_an_effect_lowers_errors_on_average_over_the_outputs(
    errors: tuple[float, ...], without: tuple[float, ...], lower: bool
) -> None:
    gap, rest = (_gap(values) for values in (errors, without))
    assert _is_lower(gap, rest, DEFAULT_THRESHOLDS) == lower


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
