"""Jacobians of rates and outputs along a path, which carry small changes to the window errors (Bock 1987).

Everything that could be wrong changes the errors of the windows in proportion to its size, as long as it is
small. The factors follow from one simulation: dx' = A dx + B r, dy = C dx + D r.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.columns import propagation
from unmodelled.diagnosis.columns.path import Path
from unmodelled.effects.place import Place
from unmodelled.engine.machine.program import Equations, Program, assembled
from unmodelled.systems.model import symbol
from unmodelled.systems.sticking import STEP_LENGTH, held

#: Step of a central difference, as a share of the largest value: a smoothed corner is a thousandth of it.
STEP = 1e-6


@dataclass(frozen=True, eq=False)
class Jacobians:
    """Derivatives on the half grid of a path by its states, inputs, efforts and parameters."""

    path: Path
    _by: dict[Place, tuple[Array, Array]] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def _program(self) -> Program:
        """Integrated rates, and outputs, of states, inputs with efforts beside known laws, and parameters."""
        s = self.path.system
        beside = {symbol(p.effort): symbol(p.effort) + p.law for p in s.ports if p.law is not None}
        step = {STEP_LENGTH: sp.Float(self.path.step)}
        rates = (f.xreplace(step) for f in held(s.x, s.closed))
        shown = [*rates, *(o.expression.xreplace(beside) for o in s.outputs)]
        return assembled(Equations(s.x, (*s.u, *s.e), s.p, s.c, [], shown, {}, s.tables))

    def _slope(self, group: int, k: int, size: float) -> Array:
        """Central differences (windows, 2 K + 1, rates and outputs) by a state, input or parameter."""
        path = self.path
        none = np.zeros((*path.t.shape, len(path.system.ports)))
        arguments = [path.x, np.concatenate([path.u, none], axis=2), path.values[path.owner][:, None]]
        ends = []
        for sign in (1.0, -1.0):
            moved = list(arguments)
            moved[group] = arguments[group].copy()
            moved[group][..., k] += sign * STEP * size
            x, u, p = moved
            ends.append(self._program.evaluate(path.t, x, u, p, path.c[path.owner][:, None]))
        with np.errstate(all="ignore"):  # both ends of a pole are infinite
            slope = (ends[0] - ends[1]) / (2.0 * STEP * size)
        return np.nan_to_num(slope, posinf=0.0, neginf=0.0)

    @cached_property
    def _by_states(self) -> Array:
        """Derivatives (windows, 2 K + 1, rates and outputs, states)."""
        sizes = [float(np.abs(x).max()) or 1.0 for x in np.moveaxis(self.path.x, 2, 0)]
        return np.stack([self._slope(0, k, size) for k, size in enumerate(sizes)], axis=3)

    @cached_property
    def transitions(self) -> tuple[Array, Array]:
        """Return the transitions, shape (windows, K, states, states), of a sample and of its second half."""
        A = np.ascontiguousarray(self._by_states[:, :, : len(self.path.system.states)])
        whole, second = propagation.transitions(A, self.path.period)
        return whole, second

    @cached_property
    def shown(self) -> Array:
        """Return the derivatives (windows, K + 1, outputs, states) of outputs, in sensor noise, by states."""
        found = self._by_states[:, ::2, len(self.path.system.states) :]
        return np.ascontiguousarray(found / self.path.recording.noise[:, None])

    def by(self, place: Place) -> tuple[Array, Array]:
        """Return slopes of rates (windows, 2 K + 1, states) and outputs (windows, K + 1, outputs)."""
        if place not in self._by:
            self._by[place] = self._derived(place)
        return self._by[place]

    def _derived(self, place: Place) -> tuple[Array, Array]:
        s, noise = self.path.system, self.path.recording.noise
        windows, half = self.path.t.shape
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
        path, s = self.path, self.path.system
        if place.kind == "port":
            number = [p.name for p in s.ports].index(place.name)
            effort = path.hypothesis.study.scales.effort.get(place.name, 0.0)
            return 1, len(s.inputs) + number, effort or 1.0
        if place.kind == "actuator":
            number = [item.name for item in s.inputs].index(place.name)
            return 1, number, float(np.abs(path.u[..., number]).max()) or 1.0
        number = [p.name for p in s.parameters].index(place.name)
        return 2, number, float(np.abs(path.values[:, number]).max()) or 1.0

    @cached_property
    def start_gain(self) -> tuple[Array, Indices, Mask]:
        """Return gains (windows, measured states) of measured states, outputs, and which are rates."""
        path, readings = self.path, self.path.readings
        C = self.shown[:, 0] * path.recording.noise[:, None]
        shown = {r.output: r.state for r in readings if not r.slope}
        output = np.array([r.output for r in readings])
        state = np.array([shown.get(r.output, r.state) for r in readings])
        # behind a lag, the state itself is not shown: such a difference is round-off
        gain, size = C[:, output, state], np.abs(path.x[..., state]).max(axis=(0, 1))
        none = np.abs(gain) * size <= STEP * path.recording.scale[output]
        return np.where(none, 1.0, gain), output, np.array([bool(r.slope) for r in readings])

    def propagated(self, slopes: tuple[Array, Array], forcing: Array, start: Array) -> Array:
        """Return changes (judged windows, K, outputs, N) of the errors, in sensor noise.

        By forcings (windows, 2 K + 1, N) of what rates and outputs have the `slopes`, see `by`, and by
        changes of the initial states (windows, states, N).
        """
        path, (B, D) = self.path, slopes
        windows = path.recording.steps, path.judged, *path.chain, path.period
        found: Array = propagation.propagate(*self.transitions, B, self.shown, D, forcing, start, *windows)
        return found

    def started(self, start: Array) -> Array:
        """Return changes of the errors by changes of the initial states (windows, states, N) alone."""
        none = np.zeros(self.path.x.shape), np.zeros(self.shown.shape[:3])
        return self.propagated(none, np.zeros((*self.path.t.shape, start.shape[2])), start)
