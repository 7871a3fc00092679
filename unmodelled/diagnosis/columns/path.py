"""The known physics simulated once over all windows: states, inputs and errors along the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.floor import start_noise
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.residuals import spread, weights
from unmodelled.diagnosis.fitting.simulation import Runs, Simulation
from unmodelled.engine.machine.program import Program
from unmodelled.logs.clock import EVERY
from unmodelled.logs.readings import Reading
from unmodelled.systems.model import System


class _StateRuns(Simulation):
    """Free runs that also keep the states, shape (windows, sets, K + 1, states)."""

    def __init__(self, hypothesis: Hypothesis, recording: Recording) -> None:
        def with_states(system: System, shown: Sequence[sp.Expr]) -> Program:
            return Program.of(system, [*shown, *system.x])

        super().__init__(hypothesis.full, recording, hypothesis.delays, hypothesis.c, with_states)

    def _shown(self, y: Array, values: Array) -> Runs:
        many = len(self.system.outputs)
        self.states = y[..., many:]
        return super()._shown(np.ascontiguousarray(y[..., :many]), values)


@dataclass(frozen=True, eq=False)
class Path:
    """A free run of a fitted hypothesis. Half grid: samples and middles, 2 K + 1 points of K steps."""

    hypothesis: Hypothesis
    system: System  # with the effects of the hypothesis
    recording: Recording
    values: Array  # (experiments, parameters), SI
    c: Array  # (experiments, constants)
    t: Array  # time on the half grid, (windows, 2 K + 1), s
    x: Array  # states on the half grid, (windows, 2 K + 1, states), SI
    u: Array  # inputs on the half grid, (windows, 2 K + 1, inputs), SI
    judged: Mask  # windows whose errors are compared, (windows,); the others lead up to them
    #: Measured minus simulated, (judged windows, K, outputs), in sensor noise; zero where it does not count.
    error: Array
    root: Array  # square roots of Huber's weights, same shape (judged windows, ...) and zeros
    sigma: Array  # noise of the measured initial states, (windows, measured states), SI
    measured: list[int]  # numbers of the states that outputs show
    hidden: list[int]  # numbers of the other states
    readings: tuple[Reading, ...]
    step: float  # length of an integration step, s
    log_x: Array  # states at all samples, as the sensors show them, (samples, states), SI
    log_u: Array  # inputs at all samples, (samples, inputs), SI

    @classmethod
    def of(cls, fitted: FittedHypothesis, recording: Recording, most: int | None = None) -> Path:
        """Simulate a fitted hypothesis over some windows, from the measured states.

        The change of hidden states is integrated from window to window: none may be left out.
        """
        few = recording if most is None else recording.thinned(most)
        runs = _StateRuns(fitted.hypothesis, few)
        if runs.hidden:
            runs = _StateRuns(fitted.hypothesis, recording)
        error, usable = _errors(runs, fitted, None)
        huber = weights(error, spread(error, np.asarray(usable.all(axis=2), np.bool_)))
        judged = np.isin(runs.recording.start, few.start)
        return cls._along(fitted, runs, error, np.sqrt(huber) * usable, judged)

    @classmethod
    def of_windows(cls, fitted: FittedHypothesis, recording: Recording) -> Path:
        """Simulate a fitted hypothesis over windows that it was fitted to, from the fitted starts.

        Measured starts are too far off for long windows. Errors have no robust weights: those of a model
        without a law that acts rarely hide this law.
        """
        runs = _StateRuns(fitted.hypothesis, recording)
        moved, sigma = fitted.moved(recording)
        error, usable = _errors(runs, fitted, (moved * sigma)[:, None])
        return cls._along(fitted, runs, error, usable.astype(float), np.ones(len(recording.start), np.bool_))

    @classmethod
    def _along(
        cls, fitted: FittedHypothesis, runs: _StateRuns, error: Array, root: Array, judged: Mask
    ) -> Path:
        """The path of free runs that were simulated, with errors and weights of all windows."""
        recording, numbers = runs.recording, fitted.fit.numbers
        tables = runs.reader(numbers, recording, EVERY)
        x, rows = _held(runs.states[:, 0]), _rows(recording)
        log_x = np.zeros((len(recording.logs.t), x.shape[2]))
        log_x[:, runs.measured] = tables.x[0]
        for k in runs.hidden:  # as in the windows
            log_x[rows, k] = x[:, :, k]
        t, half_x, u = _half_grid(runs.system, recording, x, tables.u[0])
        path = cls(
            hypothesis=fitted.hypothesis,
            system=runs.system,
            recording=recording,
            values=numbers[:, 0, : len(runs.system.parameters)],
            c=runs.c,
            t=t,
            x=half_x,
            u=u,
            judged=judged,
            error=error[judged],
            root=root[judged],
            sigma=start_noise(runs, numbers),
            measured=runs.measured,
            hidden=runs.hidden,
            readings=runs.reader.readings,
            step=recording.logs.period / _substeps(fitted),
            log_x=log_x,
            log_u=tables.u[0],
        )
        # between samples the cubic through the states and their rates, as the Runge-Kutta step goes
        rate = path.evaluate(path.system.closed)[:, ::2]
        bent = recording.logs.period / 8.0 * (rate[:, :-1] - rate[:, 1:])
        return replace(path, x=_woven(x, 0.5 * (x[:, :-1] + x[:, 1:]) + bent))

    @property
    def owner(self) -> Indices:
        """Return the experiment, shape (windows,), of every window."""
        return self.recording.owner

    @property
    def period(self) -> float:
        """Return the sampling period, s."""
        return self.recording.logs.period

    @property
    def gap(self) -> float:
        """Return the root mean square error in standard deviations of the outputs."""
        off = self.error * self.recording.noise / self.recording.scale
        return float(np.sqrt(np.mean(off[self.recording.counted[self.judged]] ** 2)))

    def evaluate(self, expressions: Sequence[sp.Expr], log: bool = False) -> Array:
        """Return values of expressions of the system's symbols.

        Args:
            expressions: expressions; an effort stands for the addition to the known law, zero.
            log: whether they are wanted at all samples of the logs instead of the half grid.

        Returns:
            Values, shape (windows, 2 K + 1, expressions) or (samples, expressions), SI.
        """
        program = Program.of_values(self.system, expressions)
        with np.errstate(all="ignore"):
            if log:
                logs = self.recording.logs
                own = (v[logs.owner] for v in (self.values, self.c))
                found = program.evaluate(logs.t, self.log_x, self.log_u, *own)
            else:
                own = (v[self.owner][:, None] for v in (self.values, self.c))
                found = program.evaluate(self.t, self.x, self.u, *own)
        return np.nan_to_num(found, posinf=0.0, neginf=0.0)

    @cached_property
    def chain(self) -> tuple[Indices, Mask, Mask]:
        """Return windows (windows,) in the order of time, which go on with the last, and hidden states."""
        start, steps = self.recording.start, self.recording.steps
        order = np.argsort(start)
        chained, last, this = np.zeros(len(order), bool), order[:-1], order[1:]
        chained[this] = (self.owner[this] == self.owner[last]) & (start[this] == start[last] + steps[last])
        return order, chained, np.isin(np.arange(self.x.shape[2]), self.hidden)


def _errors(runs: _StateRuns, fitted: FittedHypothesis, start: Array | None) -> tuple[Array, Mask]:
    """Errors (windows, K, outputs) in sensor noise, zero where they do not count, and where they do."""
    recording = runs.recording
    with np.errstate(all="ignore"):
        shown = runs(fitted.fit.numbers, start, substeps=_substeps(fitted))
    error = (shown.measured[:, 0] - shown.y[:, 0]) / recording.noise
    # small changes tell nothing where the simulation is far off or has diverged
    usable = recording.counted[:, :, None] & (np.abs(error) < _largest(recording))
    usable &= np.isfinite(runs.states[:, 0, 1:]).all(axis=2, keepdims=True)
    if shown.left_out is not None:
        usable &= ~shown.left_out
    return np.where(usable, error, 0.0), usable


def _substeps(fitted: FittedHypothesis) -> int:
    """Integration steps per sample of a path, which has states in the middle between samples."""
    return max(2, fitted.fit.substeps)


def _largest(recording: Recording) -> Array:
    return LARGEST_ERROR * recording.scale / recording.noise


def _rows(recording: Recording) -> Indices:
    """Samples (windows, K + 1) of windows; after the end of a window its last sample."""
    ahead = np.arange(int(recording.steps.max()) + 1)
    return np.asarray(recording.start[:, None] + np.minimum(ahead, recording.steps[:, None]))


def _half_grid(system: System, recording: Recording, x: Array, inputs: Array) -> tuple[Array, Array, Array]:
    """Time, states (straight between samples) and inputs on the half grid."""
    rows, course = _rows(recording), np.array([item.course for item in system.inputs])
    t, u = recording.logs.t[rows], inputs[rows]
    between = u[:, :-1] + 0.5 * course * (u[:, 1:] - u[:, :-1])
    middles = 0.5 * (t[:, :-1] + t[:, 1:]), 0.5 * (x[:, :-1] + x[:, 1:])
    return _woven(t, middles[0]), _woven(x, middles[1]), _woven(u, between)


def _held(x: Array) -> Array:
    """States (windows, K + 1, states); after the end of a window or of a finite run, the last finite ones."""
    good = np.isfinite(x).all(2)
    last = np.maximum.accumulate(np.where(good, np.arange(x.shape[1]), 0), axis=1)
    return np.nan_to_num(np.take_along_axis(x, last[..., None], axis=1))


def _woven(at_samples: Array, between: Array) -> Array:
    woven = np.empty((at_samples.shape[0], 2 * at_samples.shape[1] - 1, *at_samples.shape[2:]))
    woven[:, ::2], woven[:, 1::2] = at_samples, between
    return woven
