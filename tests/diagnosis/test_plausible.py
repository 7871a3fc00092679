"""A diagnosis says which of its numbers make no sense, and which the logs do not determine."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import FRICTION, Bench
from tests.diagnosis.planted import plant
from tests.diagnosis.studies import ANGLE, HORIZON, JOINT, TORQUE, effect, fitted, study
from tests.machines.folders import read_case
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.remark import Remark
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.doubts.efforts import Efforts
from unmodelled.diagnosis.doubts.implausible import implausible
from unmodelled.diagnosis.doubts.numbers import Numbers
from unmodelled.diagnosis.doubts.undetermined import Determination, remarks, undetermined
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.diagnosis.judge.last_fits import LastFit
from unmodelled.diagnosis.where.where import where

UNKNOWN_J = (
    "J: {value: 0.02, unit: kg m^2}",
    "J: {value: 0.02, unit: kg m^2, identify: true, bounds: [0, 0.1]}",
)
STILL = Bench(friction=0.0, runs=3)


def only(found: tuple[Remark, ...]) -> Remark:
    (one,) = found
    return one


def numbers(fitted: FittedHypothesis) -> Numbers:
    """Of a fit whose errors are independent."""
    return Numbers(LastFit(fitted, 1.0))


def fit_of(folder: Path, *changes: tuple[str, str], **bench: float) -> FittedHypothesis:
    """The known physics of a pendulum without friction, fitted to three runs."""
    return fitted(Hypothesis.known(study(folder, replace(STILL, **bench), *changes)))  # type: ignore[arg-type]


def with_values(found: FittedHypothesis, values: Mapping[str, float]) -> FittedHypothesis:
    assert set(values) <= set(found.fit.values)
    return replace(found, fit=replace(found.fit, values={**found.fit.values, **values}))


@pytest.fixture(scope="module")
def dry(tmp_path_factory: pytest.TempPathFactory) -> FittedHypothesis:
    """The pendulum's dry friction, found where it is."""
    known = Hypothesis.known(study(tmp_path_factory.mktemp("dry"), Bench(runs=3, samples=400)))
    return fitted(known.plus(effect("coulomb_friction"), JOINT))


def test_a_clean_fit_says_nothing(dry: FittedHypothesis) -> None:
    assert remarks(numbers(dry)) == ()
    assert all(
        Determination.of(dry).determined(name) and not dry.at_bound(name) for name in ("b", "mgl", "F_c")
    )


def test_a_free_swing_determines_only_ratios(tmp_path: Path) -> None:
    system, logs = replace(STILL, supply=0.0).recorded(tmp_path, UNKNOWN_J)
    swing = fitted(Hypothesis.known(Study.of(system, replace(logs, u=0.0 * logs.u), HORIZON, 0)))
    found = only(undetermined(swing))
    assert (set(found.numbers), found.kind) == ({"J", "b", "mgl"}, "undetermined")
    told = "these logs determine only J/b and J/mgl, not J, b and mgl by themselves"
    assert found.sentence.startswith(told)
    assert not any(Determination.of(swing).determined(name) for name in ("J", "b", "mgl"))
    assert implausible(numbers(swing)) == ()


def test_a_torque_determines_all_of_them(tmp_path: Path) -> None:
    assert undetermined(fit_of(tmp_path, UNKNOWN_J)) == ()


def test_a_number_without_influence_is_not_determined(tmp_path: Path) -> None:
    idle = ("ports:", "  idle: {value: 1.0, unit: '1', identify: true, bounds: [0, 2]}\nports:")
    swing = fit_of(tmp_path, idle)
    found = only(undetermined(swing))
    assert found.numbers == ("idle",) and "do not determine idle" in found.sentence
    assert not Determination.of(swing).determined("idle") and Determination.of(swing).determined("mgl")


def test_a_weight_beside_a_weight(tmp_path: Path) -> None:
    """The sine of an unknown weight is that of the pendulum's own; only their sum is seen."""
    plant(tmp_path, effect("gravity_load"))
    known = Hypothesis.known(Study.of(*read_case(tmp_path), HORIZON, 0))
    found = only(undetermined(fitted(known.plus(effect("gravity_load"), JOINT))))
    assert set(found.numbers) == {"mgl", "W_s"}
    assert "while W_s of gravity load at joint falls by more than 100 %" in found.sentence


def test_an_inertia_beside_an_inertia(tmp_path: Path) -> None:
    """It may be zero, but only because the known one can be larger."""
    known = Hypothesis.known(study(tmp_path, STILL, UNKNOWN_J))
    found = fitted(known.plus(effect("inertia_error"), JOINT))
    (remark,) = (r for r in remarks(numbers(found)) if "dM" in r.numbers)
    assert (set(remark.numbers), remark.kind) == ({"J", "dM"}, "undetermined")


def test_the_numbers_of_a_polynomial_are_one_curve(tmp_path: Path) -> None:
    plant(tmp_path, effect("nonlinear_spring", "polynomial"))
    known = Hypothesis.known(Study.of(*read_case(tmp_path), HORIZON, 0))
    found = only(undetermined(fitted(known.plus(effect("nonlinear_spring", "polynomial"), JOINT))))
    assert "these logs determine its curve, not F_1, F_2, F_3 and F_4 one by one" in found.sentence


def test_a_number_at_a_bound(tmp_path: Path) -> None:
    found = fit_of(tmp_path, mgl=5.5)
    remark = only(remarks(numbers(found)))
    assert (remark.numbers, remark.kind) == (("mgl",), "bound")
    assert "mgl is at its upper bound, 5 N m: these logs ask for more" in remark.sentence
    assert found.at_bound("mgl") and not found.at_bound("b")


def test_none_of_a_damping(tmp_path: Path) -> None:
    found = fit_of(tmp_path, b=-0.02)
    assert "b is at its bound of 0 N m s/rad" in only(remarks(numbers(found))).sentence


@pytest.mark.parametrize(
    ("value", "end"), [(0.0, 0.0), (1e-5, 0.0), (0.02, None), (0.1, 0.1), (0.09995, 0.1), (0.099, None)]
)
def test_how_near_a_bound_is(value: float, end: float | None) -> None:
    assert Unknown("b", 0.0, 0.1, 0.03).bound(value, 1e-3) == end
    assert Unknown("x_0", -np.inf, np.inf, 0.1).bound(value, 1e-3) is None


def test_the_largest_effort_is_that_of_the_logs(dry: FittedHypothesis) -> None:
    """The torque is 1 N m at most, and the weight 1.2 N m times the sine of the angle."""
    assert 0.5 < Efforts(dry).largest("joint") < 2.5


def test_a_friction_that_nothing_could_overcome(dry: FittedHypothesis) -> None:
    remark = only(implausible(numbers(with_values(dry, {"F_c": 3.5}))))
    limit = Efforts(dry).largest("joint")
    assert (remark.numbers, remark.kind) == (("F_c",), "effort")
    times = f"F_c = 3.5 N m is {3.5 / limit:.2g} times the largest torque that acts at joint"
    assert times in remark.sentence
    assert f"({limit:.3g} N m)" in remark.sentence


def test_a_load_larger_than_all_that_acts(dry: FittedHypothesis) -> None:
    loaded = fitted(Hypothesis.known(dry.hypothesis.study).plus(effect("constant_load"), JOINT))
    remark = only(implausible(numbers(with_values(loaded, {"F_0": -4.0}))))
    assert remark.kind == "effort" and "a torque of up to 4 N m" in remark.sentence


def test_an_effect_that_may_be_zero(tmp_path: Path) -> None:
    known = Hypothesis.known(study(tmp_path, STILL))
    (remark,) = implausible(numbers(fitted(known.plus(effect("constant_load"), JOINT))))
    assert remark.kind == "zero" and "may as well be zero" in remark.sentence


@pytest.mark.parametrize(
    ("family", "place", "most"), [("sensor_gain", ANGLE, 0.2), ("actuator_gain", TORQUE, 0.5)]
)
def test_a_gain_that_no_part_has(dry: FittedHypothesis, family: str, place: object, most: float) -> None:
    found = fitted(dry.hypothesis.plus(effect(family), place))  # type: ignore[arg-type]
    (gain,) = found.hypothesis.effects[-1].amplitudes
    near, far = (
        [r.kind for r in implausible(numbers(with_values(found, {gain: share * most})))]
        for share in (0.9, 1.1)
    )
    assert "gain" not in near and "gain" in far


def test_a_mass_that_is_not_there(dry: FittedHypothesis) -> None:
    found = fitted(dry.hypothesis.plus(effect("inertia_error"), JOINT))
    remarks_of_it = implausible(numbers(with_values(found, {"dM": 0.03})))
    (remark,) = (r for r in remarks_of_it if r.numbers == ("dM",))
    assert remark.kind == "mass"
    assert "dM = 0.03 kg m^2 is 1.5 times the known one there (0.02 kg m^2)" in remark.sentence


def test_a_sign_and_a_mass_of_the_file(tmp_path: Path) -> None:
    pull = (
        "mgl: {value: 0.9, unit: N m, identify: true, bounds: [0.2, 5]}",
        "mgl: {value: -0.9, unit: N m, identify: true, bounds: [-2, 5]}",
    )
    heavy = ("J: {value: 0.02,", "J: {value: 0.005, identify: true, bounds: [0.001, 1],")
    found = implausible(numbers(fit_of(tmp_path, pull, heavy)))
    assert {r.numbers[0]: r.kind for r in found} == {"mgl": "sign", "J": "mass"}
    assert "J is 4 times the given value: 0.02 kg m^2" in " ".join(r.sentence for r in found)


def test_one_factor_of_all_parameters_is_that_of_the_torque(tmp_path: Path) -> None:
    exact = (("b: {value: 0.03,", "b: {value: 0.015,"), ("mgl: {value: 0.9,", "mgl: {value: 1.2,"), UNKNOWN_J)
    system, logs = STILL.recorded(tmp_path, *exact)
    found = fitted(Hypothesis.known(Study.of(system, replace(logs, u=1.19 * logs.u), HORIZON, 0)))
    remark = only(implausible(numbers(found)))
    assert remark.kind == "common_factor" and {"J", "mgl"} <= set(remark.numbers)
    assert "are 1.19 times their given values, as if torque were 0.84" in remark.sentence


def test_one_factor_without_an_input_says_nothing(tmp_path: Path) -> None:
    """b and mgl twice as large are no scale of the torque while J is known."""
    assert implausible(numbers(fit_of(tmp_path, b=0.06, mgl=1.8))) == ()


@pytest.mark.long
def test_a_diagnosis_hands_the_remarks_on(tmp_path: Path) -> None:
    narrow = ("bounds: [0.2, 5]", "bounds: [0.2, 1]")
    case = Bench(runs=3, samples=200).recorded(tmp_path, UNKNOWN_J, narrow, *FRICTION)
    found = diagnose_gap(*case, HORIZON, 0)
    content = summary(found, where(found))
    assert {"determined", "at_bound"} <= set(content["parameters"]["mgl"])
    assert content["parameters"]["mgl"]["determined"] is found.parameters["mgl"].determined
    assert content["parameters"]["mgl"]["at_bound"] is found.parameters["mgl"].at_bound
    if found.parameters["mgl"].at_bound:
        assert any("mgl is at its upper bound" in note for note in found.notes)
