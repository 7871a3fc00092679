"""The known physics simulated once over all windows, with its Jacobians along the way (Bock 1987).

Everything that could be wrong changes the errors of the windows in proportion to its size, as long as it is
small. The factors follow from one simulation: dx' = A dx + B r, dy = C dx + D r.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.columns import propagation
from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.floor import start_noise
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.residuals import spread, weights
from unmodelled.diagnosis.fitting.simulation import Runs, Simulation
from unmodelled.effects.place import Place
from unmodelled.engine.machine.program import Equations, Program, assembled
from unmodelled.logs.clock import EVERY
from unmodelled.logs.readings import Reading
from unmodelled.systems.model import System, symbol
from unmodelled.systems.sticking import STEP_LENGTH, held

#: Step of a central difference, as a share of the largest value: a smoothed corner is a thousandth of it.
STEP = 1e-6


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
    _by: dict[Place, tuple[Array, Array]] = field(default_factory=dict, init=False, repr=False)

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
    def _program(self) -> Program:
        """Integrated rates, and outputs, of states, inputs with efforts beside known laws, and parameters."""
        s = self.system
        beside = {symbol(p.effort): symbol(p.effort) + p.law for p in s.ports if p.law is not None}
        step = {STEP_LENGTH: sp.Float(self.step)}
        rates = (f.xreplace(step) for f in held(s.x, s.closed))
        shown = [*rates, *(o.expression.xreplace(beside) for o in s.outputs)]
        return assembled(Equations(s.x, (*s.u, *s.e), s.p, s.c, [], shown, {}, s.tables))

    def _slope(self, group: int, k: int, size: float) -> Array:
        """Central differences (windows, 2 K + 1, rates and outputs) by a state, input or parameter."""
        none = np.zeros((*self.t.shape, len(self.system.ports)))
        arguments = [self.x, np.concatenate([self.u, none], axis=2), self.values[self.owner][:, None]]
        ends = []
        for sign in (1.0, -1.0):
            moved = list(arguments)
            moved[group] = arguments[group].copy()
            moved[group][..., k] += sign * STEP * size
            x, u, p = moved
            ends.append(self._program.evaluate(self.t, x, u, p, self.c[self.owner][:, None]))
        with np.errstate(all="ignore"):  # both ends of a pole are infinite
            slope = (ends[0] - ends[1]) / (2.0 * STEP * size)
        return np.nan_to_num(slope, posinf=0.0, neginf=0.0)

    @cached_property
    def _by_states(self) -> Array:
        """Derivatives (windows, 2 K + 1, rates and outputs, states)."""
        sizes = [float(np.abs(x).max()) or 1.0 for x in np.moveaxis(self.x, 2, 0)]
        return np.stack([self._slope(0, k, size) for k, size in enumerate(sizes)], axis=3)

    @cached_property
    def transitions(self) -> tuple[Array, Array]:
        """Return the transitions, shape (windows, K, states, states), of a sample and of its second half."""
        A = np.ascontiguousarray(self._by_states[:, :, : len(self.system.states)])
        whole, second = propagation.transitions(A, self.period)
        return whole, second

    @cached_property
    def shown(self) -> Array:
        """Return the derivatives (windows, K + 1, outputs, states) of outputs, in sensor noise, by states."""
        found = self._by_states[:, ::2, len(self.system.states) :]
        return np.ascontiguousarray(found / self.recording.noise[:, None])

    def by(self, place: Place) -> tuple[Array, Array]:
        """Return slopes of rates (windows, 2 K + 1, states) and outputs (windows, K + 1, outputs)."""
        if place not in self._by:
            self._by[place] = self._derived(place)
        return self._by[place]

    def _derived(self, place: Place) -> tuple[Array, Array]:
        s, noise = self.system, self.recording.noise
        windows, half = self.t.shape
        if place.kind == "sensor":
            direct = np.zeros((windows, half // 2 + 1, len(noise)))
            output = [o.name for o in s.outputs].index(place.name)
            direct[..., output] = 1.0 / noise[output]
            return np.zeros((windows, half, len(s.states))), direct
        found = self._slope(*self._argument(place))
        rates, outputs = np.split(found, [len(s.states)], axis=2)
        return np.ascontiguousarray(rates), np.ascontiguousarray(outputs[:, ::2] / noise)

    def _argument(self, place: Place) -> tuple[int, int, float]:
        """Group of arguments, number in it and size of the quantity at a place."""
        s, scales = self.system, self.hypothesis.study.scales
        if place.kind == "port":
            number = [p.name for p in s.ports].index(place.name)
            return 1, len(s.inputs) + number, scales.effort.get(place.name, 0.0) or 1.0
        if place.kind == "actuator":
            number = [item.name for item in s.inputs].index(place.name)
            return 1, number, float(np.abs(self.u[..., number]).max()) or 1.0
        number = [p.name for p in s.parameters].index(place.name)
        return 2, number, float(np.abs(self.values[:, number]).max()) or 1.0

    @cached_property
    def chain(self) -> tuple[Indices, Mask, Mask]:
        """Return windows (windows,) in the order of time, which go on with the last, and hidden states."""
        start, steps = self.recording.start, self.recording.steps
        order = np.argsort(start)
        chained, last, this = np.zeros(len(order), bool), order[:-1], order[1:]
        chained[this] = (self.owner[this] == self.owner[last]) & (start[this] == start[last] + steps[last])
        return order, chained, np.isin(np.arange(self.x.shape[2]), self.hidden)

    @cached_property
    def start_gain(self) -> tuple[Array, Indices, Mask]:
        """Return gains (windows, measured states) of measured states, outputs, and which are rates."""
        C = self.shown[:, 0] * self.recording.noise[:, None]
        shown = {r.output: r.state for r in self.readings if not r.slope}
        output = np.array([r.output for r in self.readings])
        state = np.array([shown.get(r.output, r.state) for r in self.readings])
        # behind a lag, the state itself is not shown: such a difference is round-off
        gain, size = C[:, output, state], np.abs(self.x[..., state]).max(axis=(0, 1))
        none = np.abs(gain) * size <= STEP * self.recording.scale[output]
        return np.where(none, 1.0, gain), output, np.array([bool(r.slope) for r in self.readings])


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
