"""The lag of a measurement chain, which can be nothing, and starts of states that no sensor shows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import PERIOD, Bench
from tests.diagnosis.studies import TORQUE, effect, shared_study, study
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.columns.columns import Columns
from unmodelled.diagnosis.columns.path import Path as WindowPath
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.judge.residual import Residual
from unmodelled.logs.measurements import Continued

bench = shared_study(Bench(friction=0.0, samples=300))


def shown(found: Study, lag: float | None, delay: float = 0.0) -> Array:
    """The simulated angle with a lag of the torque, None for none, and a delay, s."""
    known = Hypothesis.known(found)
    hypothesis = known if lag is None else known.plus(effect("actuator_lag"), TORQUE)
    simulation = hypothesis.simulation(found.recording)
    numbers = simulation.values
    if lag is not None:
        numbers[simulation.names.index("T_u")] = lag
    numbers[simulation.names.index("timing_torque")] = delay
    return simulation(numbers[None, None], substeps=2).y


def test_a_lag_can_be_nothing(bench: Study) -> None:
    assert shown(bench, 0.0) == pytest.approx(shown(bench, None), abs=1e-12, nan_ok=True)


@pytest.mark.parametrize("samples", [0.25, 0.5, 1.0])
def test_a_short_lag_acts_like_a_delay_of_its_length(bench: Study, samples: float) -> None:
    """A lag that is no more than a sample is neither cut off nor rounded up."""
    lag = samples * PERIOD
    none, lagged, late = shown(bench, None), shown(bench, lag), shown(bench, None, lag)
    left, moved = (np.sqrt(np.nanmean((one - lagged) ** 2)) for one in (late, none))
    assert left < 0.1 * moved


def hidden_starts(found: Study) -> Array:
    """Columns of the start of a lagged torque, (windows, K, outputs, 1)."""
    hypothesis = Hypothesis.known(found).plus(effect("actuator_lag"), TORQUE)
    fitted = FittedHypothesis.of(hypothesis, found.recording, [{"T_u": 5.0 * PERIOD}], iterations=0)
    return Columns(WindowPath.of_windows(fitted, fitted.recording)).own.columns


def test_the_start_of_a_hidden_state_does_not_depend_on_the_zero_of_its_unit(
    bench: Study, tmp_path: Path
) -> None:
    """A torque whose zero is logged 100 N m too high starts as uncertain as one that is right."""
    moved = study(tmp_path, Bench(friction=0.0, samples=300), ("omega: (torque", "omega: (torque - 100"))
    logs = replace(moved.logs, u=moved.logs.u + 100.0)
    assert hidden_starts(replace(moved, logs=logs)) == pytest.approx(hidden_starts(bench), rel=1e-6, abs=1e-9)


def test_states_of_a_record_that_goes_on_start_where_they_were(bench: Study) -> None:
    first, *others = bench.logs.ids
    logs = replace(bench.logs, continues=(None, *(Continued(first, 1) for _ in others)))
    columns = hidden_starts(replace(bench, logs=logs))
    alone = hidden_starts(bench)
    assert np.any(alone) and not np.array_equal(columns, alone)
    assert np.count_nonzero(columns) < 0.5 * np.count_nonzero(alone)


def test_a_lag_may_start_anywhere_where_a_record_begins(tmp_path: Path) -> None:
    """A log begins with the command, an actuator at rest: the lag is right, and its starts are found."""
    found = study(tmp_path, Bench(friction=0.0, lag=10.0 * PERIOD))
    hypothesis = Hypothesis.known(found).plus(effect("actuator_lag"), TORQUE)
    fitted = FittedHypothesis.of(hypothesis, found.recording, [{"T_u": 5.0 * PERIOD}])
    assert fitted.fit.values["T_u"] == pytest.approx(10.0 * PERIOD, rel=0.03)
    assert np.sqrt(Residual.of(fitted).square) == pytest.approx([1.0], abs=0.1)
    recording, starts = fitted.recording, fitted.fit.start[:, -1]
    begun = recording.start == recording.logs.offsets[recording.owner]
    assert starts[begun] == pytest.approx(-recording.logs.u[recording.start[begun], 0], abs=0.05)
    assert not starts[~begun].any()
