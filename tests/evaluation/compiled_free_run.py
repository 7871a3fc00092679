"""Free runs on the compiled engine, to compare those of the expression machine with."""

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from unmodelled.diagnosis.data.gap import WHOLE, FreeRun, steps_of
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.engine.free_run import Integration
from unmodelled.learning.held_out import measured_samples
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.rollout import simulate
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Windows = tuple[Indices, int]  # first samples, steps

#: Samples that are simulated at a time.
PART = 200_000


def free_run(
    system: System, logs: Logs, horizon: float, how: Integration, runs: Sequence[int] | None = None
) -> FreeRun:
    """Simulate experiments under their logged inputs, starting anew every `horizon` seconds.

    A window starts at the measured or estimated state and predicts the samples up to the start of the next
    one, that one included; the last window of an experiment may be shorter.

    An output with a delay shows what was simulated so long ago, whichever window that was in; before, at the
    start of an experiment, it shows nothing that was simulated. The log does not show the states of the last
    part of an experiment, as long as the longest delay; the simulation ends there.

    Args:
        system: laws of its ports included. logs: with the states of `system`.
        horizon: s, rounded to samples. how: the integration. runs: which experiments; all unless given.
    """
    if logs.states != tuple(s.name for s in system.states):
        raise ValueError(f"logs must have the states of {system.name}, see prepare")
    steps = steps_of(horizon, logs)
    runs = range(len(logs)) if runs is None else runs
    result = FreeRun(
        np.full(logs.y.shape, np.nan), np.zeros(logs.y.shape, np.bool_), np.zeros(len(logs.t), np.int64)
    )
    for i in runs:
        result.window[logs.rows(i)] = np.maximum(np.arange(np.diff(logs.offsets)[i]) - 1, 0) // steps
    data, sensors = measured_samples(logs), _Sensors(system, logs)
    model = _plain(system)
    sensors.start(result, logs.offsets[:-1][list(runs)])
    parts = list(_parts(sensors.last, steps, runs))
    for starts, n in parts:
        x, _ = simulate(model, 0, data, data.x[starts], starts, n, how)
        sensors.read(result, starts, x)
    return result


def _plain(system: System) -> Nnap:
    """The system without networks."""
    none = torch.empty((1, 0), dtype=torch.float64)
    p = torch.tensor([system.values], dtype=torch.float64)
    return Nnap(Augmented(system), p, none[0], none, none, none)


def _lag(delay: float, period: float) -> tuple[int, float]:
    """A delay as whole samples and the rest, from 0 to 1."""
    whole = math.floor(delay / period + WHOLE)
    rest = delay / period - whole
    return whole, rest if rest > WHOLE else 0.0


def _parts(last: Indices, steps: int, runs: Sequence[int]) -> Iterator[Windows]:
    """All windows of the experiments, those of one length together, in parts of about `PART` samples.

    `last` (n, 2): first and last sample of every experiment that has a state.
    """
    groups: dict[int, list[Indices]] = {}
    for i in runs:
        first, end = (int(k) for k in last[i])
        full, rest = divmod(end - first, steps)
        if full:
            groups.setdefault(steps, []).append(first + steps * np.arange(full))
        if rest:
            groups.setdefault(rest, []).append(np.array([end - rest]))
    for n, starts in groups.items():
        together = np.concatenate(starts).astype(np.int64)
        for part in np.array_split(together, max(1, len(together) * n // PART)):
            yield part, n


class _Sensors:
    """What the outputs show of simulated states."""

    def __init__(self, system: System, logs: Logs) -> None:
        self.logs, self.p = logs, np.array(system.values)
        delays = np.array([output.delay for output in system.outputs])
        self.groups = {float(delay): np.flatnonzero(delays == delay) for delay in np.unique(delays)}
        self.functions: dict[float, Callable[..., Array]] = {
            delay: numpy_system_function(system, [system.outputs[j].expression for j in columns], True)
            for delay, columns in self.groups.items()
        }
        held, _ = _lag(max(self.groups), logs.period)
        self.last = np.stack([logs.offsets[:-1], logs.offsets[1:] - 1 - held], axis=1)

    def start(self, result: FreeRun, first: Indices) -> None:
        """What an output without delay shows at the start of every experiment, samples `first`."""
        if 0.0 in self.groups:
            logs = self.logs
            where = logs.t[first], logs.x[first], logs.u[first]
            shown = self.functions[0.0](*where, np.empty(0), self.p, logs.c[logs.owner[first]])
            result.y[np.ix_(first, self.groups[0.0])] = shown

    def read(self, result: FreeRun, starts: Indices, x: Array) -> None:
        """Write what trajectories `x` (windows, steps + 1, states) from the samples `starts` on show."""
        steps = x.shape[1] - 1
        rows = starts[:, None] + np.arange(1, steps + 1)
        c = self.logs.c[self.logs.owner[starts]][:, None]
        finite: NDArray[np.bool_] = np.asarray(np.isfinite(x).all(-1))
        for delay, columns in self.groups.items():
            whole, rest = _lag(delay, self.logs.period)
            then = self._past(x, finite, rows, rest)
            value = self.functions[delay](*then, np.empty(0), self.p, c)
            cells = np.ix_((rows + whole).ravel(), columns)
            result.y[cells] = np.where(finite[:, 1:, None], value, np.nan).reshape(-1, len(columns))
            result.counted[cells] = True

    def _past(
        self, x: Array, finite: NDArray[np.bool_], rows: Indices, rest: float
    ) -> tuple[Array, Array, Array]:
        """Time, states and inputs `rest` of a period before the samples `rows`, from a window's second on."""
        t, u = self.logs.t, self.logs.u
        if rest == 0.0:
            return t[rows], x[:, 1:], u[rows]
        k = np.arange(x.shape[1], dtype=np.float64)
        with np.errstate(all="ignore"):
            # a spline is global: what diverged later must not reach back
            bounded = np.where(finite[..., None] & (np.abs(x) < 1e100), x, 0.0)
            before = np.asarray(CubicSpline(k, bounded, axis=1)(k[1:] - rest))
        return t[rows] - rest * self.logs.period, before, (1.0 - rest) * u[rows] + rest * u[rows - 1]
