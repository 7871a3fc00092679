"""Fitted hypotheses as models of their own."""

from dataclasses import replace

import numpy as np
import pytest

from tests.diagnosis.benches import FRICTION, PERIOD, Bench
from tests.diagnosis.studies import ANGLE, HORIZON, JOINT, effect, fitted, shared_study
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting import deviation
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model, values_per_experiment
from unmodelled.effects.place import Place
from unmodelled.logs.clock import delayed

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
