"""What a model with effects consists of, what of it is fitted, and the model that it leaves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import FRICTION, PERIOD, Bench
from tests.diagnosis.studies import ANGLE, HORIZON, JOINT, TORQUE, effect, fitted, shared_study, study
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting import deviation
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.hypothesis import INPUT_TIMING, FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model, values_per_experiment
from unmodelled.effects.place import Place
from unmodelled.logs.clock import delayed

LATE = ("  theta: {unit: rad}\nparameters:", "  theta: {unit: rad, delay: 0.01}\nparameters:")
GROUPS = ("new", "old", "old", "new")
OLD = Place("port", "joint", "group", "old")


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Hypothesis:
    return Hypothesis.known(study(tmp_path_factory.mktemp("hypothesis"), Bench(samples=300, groups=GROUPS)))


def names(hypothesis: Hypothesis) -> list[str]:
    return [u.name for u in hypothesis.unknowns]


def test_the_known_physics_and_when_an_input_acts(known: Hypothesis) -> None:
    b, mgl, timing = known.unknowns
    assert (b.name, b.low, b.high) == ("b", 0.0, 0.1) and (mgl.name, mgl.low, mgl.high) == ("mgl", 0.2, 5.0)
    most = INPUT_TIMING * PERIOD
    assert (timing.low, timing.high) == pytest.approx((-most, most))
    assert known.delays == known.timing == {timing.name: "torque"}
    assert (known.key, known.full) == (frozenset(), known.study.system)


def test_numbers_of_effects_are_fitted_within_their_bounds(known: Hypothesis) -> None:
    hypothesis = known.plus(effect("coulomb_friction"), JOINT)
    added = hypothesis.effects[0]
    assert names(hypothesis) == ["b", "mgl", "timing_torque", "F_c", "v_c"]
    for unknown in hypothesis.unknowns[3:]:
        assert (unknown.low, unknown.high) == added.bounds[unknown.name]
        assert unknown.scale == added.scales[unknown.name] and not unknown.own


def test_a_delayed_input_needs_no_timing(known: Hypothesis) -> None:
    hypothesis = known.plus(effect("input_delay"), TORQUE)
    assert names(hypothesis) == ["b", "mgl", "T_d_torque"]
    assert hypothesis.timing == {} and hypothesis.delays == {"T_d_torque": "torque"}
    assert hypothesis.unknowns[2].low == 0.0


def test_a_delayed_output_has_the_room_that_windows_leave(known: Hypothesis) -> None:
    hypothesis = known.plus(effect("sensor_delay"), ANGLE)
    assert hypothesis.delays == {"timing_torque": "torque", "T_d_theta": "theta"}
    assert hypothesis.unknowns[3].high == pytest.approx(known.study.latest)
    assert known.study.latest < hypothesis.effects[0].bounds["T_d_theta"][1]


def test_a_known_delay_takes_room_away(tmp_path: Path) -> None:
    late = study(tmp_path, Bench(samples=300), LATE)
    hypothesis = Hypothesis.known(late).plus(effect("sensor_delay"), ANGLE)
    longest = hypothesis.unknowns[-1].high
    assert longest == pytest.approx(late.latest - 0.01)
    simulation = hypothesis.simulation(late.recording)
    values = simulation.values.copy()
    values[simulation.names.index("T_d_theta")] = longest
    assert not simulation(values[None, None]).diverged.any()
    values[simulation.names.index("T_d_theta")] = longest + PERIOD
    with pytest.raises(ValueError, match="delays must be"):
        simulation(values[None, None])


def test_the_order_of_effects_does_not_matter(known: Hypothesis) -> None:
    first = known.plus(effect("coulomb_friction"), JOINT).plus(effect("sensor_gain"), ANGLE)
    second = known.plus(effect("sensor_gain"), ANGLE).plus(effect("coulomb_friction"), JOINT)
    assert first.key == second.key
    others = [
        known.plus(effect("coulomb_friction"), OLD).plus(effect("sensor_gain"), ANGLE),
        known.plus(effect("coulomb_friction", "by_direction"), JOINT).plus(effect("sensor_gain"), ANGLE),
        known.plus(effect("coulomb_friction"), JOINT),
    ]
    assert len({h.key for h in (first, *others)}) == 4


def test_effects_are_nothing_at_level_zero(known: Hypothesis) -> None:
    """Where they are not, the model is the known one; friction in some experiments changes only these."""
    recording = known.study.recording
    base = known.simulation(recording)
    expected = base(base.values[None, None]).y
    local = known.plus(effect("coulomb_friction"), OLD)
    simulation = local.simulation(recording)
    values = np.tile(simulation.values, (1, 2, 1))
    values[0, 1, simulation.names.index("F_c")] = 0.1
    found = simulation(values).y
    np.testing.assert_allclose(found[:, :1], expected, atol=1e-12)
    moved = np.nanmax(np.abs(found[:, 1] - expected[:, 0]), axis=(1, 2))
    old = np.isin(recording.owner, [1, 2])
    assert old.any() and not old.all()
    assert moved[old].min() > 1e-4 and moved[~old].max() < 1e-12


@pytest.fixture(scope="module")
def friction(known: Hypothesis) -> FittedHypothesis:
    hypothesis = known.plus(effect("coulomb_friction"), JOINT)
    return FittedHypothesis.of(hypothesis, known.study.recording)


def test_a_fit_is_compared_in_the_noise_of_the_sensors(friction: FittedHypothesis, known: Hypothesis) -> None:
    r, moved = friction.errors
    recording = friction.recording
    assert r.shape == (*recording.counted.shape, 1) and moved.shape == friction.fit.start.shape
    unit = recording.noise / recording.scale
    assert np.sqrt(np.mean(r[recording.counted] ** 2)) * unit[0] == pytest.approx(friction.fit.left.value)
    without = FittedHypothesis.of(known, recording)
    assert np.mean(np.square(without.errors[0])) > 2.0 * np.mean(np.square(r))


def test_the_vector_of_a_fit_has_the_values_of_every_experiment(known: Hypothesis) -> None:
    hypothesis = known.plus(effect("scatter"), Place("parameter", "mgl"))
    found = FittedHypothesis.of(hypothesis, known.study.recording.thinned(20), iterations=1)
    numbers = found.unknowns.numbers(found.vector(found.unknowns)[None])
    column = found.unknowns.simulation.names.index("mgl_deviation")
    assert [numbers[i, 0, column] for i in known.study.learned] == pytest.approx(
        [found.fit.own["mgl_deviation"][known.study.logs.ids[i]] for i in known.study.learned]
    )
    assert len(set(found.fit.own["mgl_deviation"].values())) == len(known.study.learned)
    assert known.study.horizon == HORIZON


#: Friction that differs from run to run.
SCATTERED = (0.03, 0.05, 0.04, 0.065, 0.055, 0.045)
EARLY = 0.5 * PERIOD
rubbing = shared_study(Bench(samples=400, delay=2, groups=("new", "old", "old", "new")))
scattered = shared_study(Bench(runs=6, friction=SCATTERED), *FRICTION)


@pytest.fixture(scope="module")
def late(rubbing: Study) -> FittedHypothesis:
    hypothesis = Hypothesis.known(rubbing).plus(effect("coulomb_friction"), JOINT)
    return fitted(hypothesis.plus(effect("sensor_delay"), ANGLE))


def earlier(found: Study, time: float) -> Study:
    """With inputs that were logged before they act."""
    logs = found.logs
    u = delayed(logs.u, logs.offsets, logs.period, [-time], "linear")
    return replace(found, logs=replace(logs, u=u))


def test_numbers_and_delays_stand_in_the_system(late: FittedHypothesis, rubbing: Study) -> None:
    found = judged_model("late", late)
    values = dict(zip((p.name for p in found.system.parameters), found.system.values, strict=True))
    assert values["F_c"] == pytest.approx(0.06, rel=0.03) and values["F_c"] == late.fit.values["F_c"]
    assert found.system.inputs[0].delay == late.fit.values["timing_torque"]
    assert found.system.outputs[0].delay == late.fit.values["T_d_theta"]
    late_by = found.system.outputs[0].delay + found.system.inputs[0].delay
    assert late_by == pytest.approx(2 * PERIOD, abs=2e-4)
    expected = free_runs(found.system, found.logs, HORIZON, rubbing.held_out)
    assert found.gap.value == pytest.approx(expected.value, rel=1e-6)
    assert 0.8 < found.gap.value / found.gap.floor < 1.25


def test_a_model_does_what_its_hypothesis_does(rubbing: Study) -> None:
    """Held-out experiments, seen through the file's numbers or through those of the fit."""
    place = Place("port", "joint", "group", "old")
    one = fitted(Hypothesis.known(rubbing).plus(effect("coulomb_friction"), place))
    found = judged_model("old", one)
    held = Recording.of(rubbing.logs, HORIZON, rubbing.held_out)
    simulation = one.hypothesis.simulation(held)
    assert found.gap.value == pytest.approx(
        deviation.gap(simulation, one.fit.numbers, found.gap.substeps).value, rel=1e-6
    )
    assert found.logs.constants == tuple(c.name for c in found.system.operating_point)
    np.testing.assert_array_equal(found.logs.c[:, -1], [0.0, 1.0, 1.0, 0.0])


@pytest.mark.long
@pytest.mark.parametrize("time", [0.0, EARLY])
def test_held_out_experiments_have_numbers_of_their_own(scattered: Study, time: float) -> None:
    """What is shared stays as it was fitted, the timing of the input too."""
    seen = earlier(scattered, time)
    one = fitted(Hypothesis.known(seen).plus(effect("scatter"), Place("parameter", "F_c")))
    assert one.fit.values["timing_torque"] == pytest.approx(time, abs=1e-4)
    own = values_per_experiment(one)["F_c_deviation"]
    learned = one.fit.own["F_c_deviation"]
    assert {i: own[i] for i in learned} == learned
    friction = {i: one.fit.values["F_c"] * (1.0 + own[i]) for i in seen.logs.ids}
    assert list(friction.values()) == pytest.approx(SCATTERED, abs=1.2e-3)
    held = [seen.logs.ids[i] for i in seen.held_out]
    off = [friction[i] - SCATTERED[seen.logs.ids.index(i)] for i in held]
    assert np.abs(off).max() < 8e-4
    found = judged_model("scattered", one)
    column = found.logs.c[:, found.logs.constants.index("F_c_deviation")]
    np.testing.assert_array_equal(column, [own[i] for i in seen.logs.ids])
    assert found.gap.value < 1.3 * found.gap.floor
