"""Persistence, the prediction without a model: every output keeps its value or its speed."""

from __future__ import annotations

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.logs.logs import Logs

#: Error of persistence at the default horizon, in standard deviations within a run.
HORIZON_ERROR = 1.0
#: Fewest samples of the default horizon.
FEWEST_SAMPLES = 25
#: Longest default horizon, as a share of the shortest usual experiment: three windows in each.
LONGEST_SHARE = 1.0 / 3.0
#: Largest number of predictions per candidate horizon (a budget of time), and ratio of candidate horizons.
STARTS, RATIO = 2000, 1.03
#: Significant digits of a default horizon in seconds, before it is rounded to a whole number of samples.
HORIZON_DIGITS = 2


def default_horizon(logs: Logs, sensors: Sensors | None = None) -> float:
    """Return the shortest horizon at which persistence errs by one standard deviation.

    Within a shorter horizon, a prediction without a model is nearly as good as a true model. The error is the
    root mean square over outputs, each in its standard deviation within runs, at the end of the horizon. An
    output is predicted by its last value or by its last value and speed, whichever is better at this horizon.
    The horizon is rounded to two digits and then to a whole number of samples. It has at least
    `fewest_horizon_samples` samples and at most the share `longest_horizon_share` of the shortest experiment,
    not counting short parts, see `Logs.usual_length`; the latter limit is the stronger one. Experiments that
    are shorter than the horizon are simulated as a whole.
    """
    longest = max(1, int(LONGEST_SHARE * logs.usual_length))
    fewest = min(FEWEST_SAMPLES, longest)
    count = 2 + int(np.log(longest / fewest) / np.log(RATIO))
    candidates = np.unique(np.geomspace(fewest, longest, count).round().astype(np.int64))
    errors = _errors_after(candidates, logs, sensors or Sensors(logs))
    large = np.flatnonzero(errors >= HORIZON_ERROR)
    steps = int(candidates[large[0]]) if len(large) else longest
    seconds = float(f"{steps * logs.period:.{HORIZON_DIGITS}g}")
    steps = min(max(round(seconds / logs.period), fewest), longest)
    return float(f"{steps * logs.period:.12g}")


def horizon_of(logs: Logs, horizon: float | None, sensors: Sensors | None = None) -> float:
    """Return the given horizon, s, or the default horizon of the logs where none is given."""
    return default_horizon(logs, sensors) if horizon is None else horizon


def persistence(recording: Recording) -> float:
    """Return the error of persistence over the windows of a recording, on the scale of the gap.

    The root mean square over outputs, windows and samples, in standard deviations of the outputs; errors are
    cut like those of free runs. An output is predicted by its last value or by its last value and speed,
    whichever is better over all windows.
    """
    found = persistence_errors(recording.sensors, recording.start[:, None], recording.rows)
    squares = _cut_squares(found / recording.scale)[:, recording.counted].mean(axis=1)
    return float(np.sqrt(squares.min(axis=0).mean()))


def persistence_errors(sensors: Sensors, start: Indices, end: Indices) -> Array:
    """Return the errors (2, *shape of `end`, outputs) without a model: constant value, and constant speed.

    The speed is the smoothed slope of the output at the start, as at the start of a free run.
    """
    logs = sensors.logs
    speed = np.stack([sensors.slope(j, 0.0) for j in range(len(logs.outputs))], axis=1)
    after = logs.period * (end - start)[..., None]
    with np.errstate(all="ignore"):
        moved = logs.y[end] - logs.y[start]
        return np.stack([moved, moved - speed[start] * after])


def _errors_after(candidates: Indices, logs: Logs, sensors: Sensors) -> Array:
    """Errors of persistence, shape (candidates,), at the ends of candidate horizons, samples."""
    samples = len(logs.y)
    start = np.linspace(0, samples - 1, min(STARTS, samples)).astype(np.int64)[:, None]
    end, last = start + candidates, logs.offsets[1:][logs.owner[start]] - 1
    within = end <= last
    found = persistence_errors(sensors, start, np.minimum(end, last)) / sensors.scale
    squares = np.einsum("pskj,sk->pkj", _cut_squares(found), within) / within.sum(axis=0)[:, None]
    return np.asarray(np.sqrt(squares.min(axis=0).mean(axis=1)))


def _cut_squares(errors: Array) -> Array:
    """Squares of errors, which are cut at `LARGEST_ERROR` as in the gap."""
    with np.errstate(all="ignore"):
        return np.fmin(errors**2, LARGEST_ERROR**2)
