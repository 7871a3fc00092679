"""The known physics with all values that a system file allows, against the travel limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.design.draws import DRAWS, drawn_between, ends_of
from unmodelled.design.limits import MARGIN, Limits
from unmodelled.design.runs import Simulated, equations, in_parts, quantities, simulated
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import Parameter, System

#: Integration steps per sample that are tried.
STEPS = (8, 16, 32, 64)


@dataclass(frozen=True, eq=False)
class Watched:
    """Simulations of the known physics that look at the travel limits, before any log exists.

    A parameter marked `identify` may have any value within its bounds.
    """

    system: System
    limits: Limits

    @property
    def uncertain(self) -> list[Parameter]:
        """Return the parameters whose values are drawn from their bounds."""
        return [p for p in self.system.parameters if p.identify and np.isfinite(p.limits).all()]

    @cached_property
    def systems(self) -> list[System]:
        """Return the system as the file has it, and with the ends and draws of the uncertain parameters.

        Bounds are far from each other: a draw of several numbers seldom has the worst ends of all.
        """
        names = [p.name for p in self.uncertain]
        if not names:
            return [self.system]
        bounds = np.array([p.limits for p in self.uncertain])
        sets = np.concatenate([ends_of(bounds), drawn_between(bounds)]).tolist()
        return [self.system, *(self.system.with_values(dict(zip(names, each, strict=True))) for each in sets)]

    @property
    def allowed(self) -> str:
        """Return the bounds of the uncertain parameters in words, "" without such parameters."""
        return ", ".join(f"{p.name} from {p.limits[0]:g} to {p.limits[1]:g} {p.unit}" for p in self.uncertain)

    @property
    def notes(self) -> list[str]:
        """Return what the travel of the experiments is sure of."""
        if not self.limits.travel:
            return []
        loose = [p.name for p in self.system.parameters if p.identify and p not in self.uncertain]
        more = f"; {', '.join(loose)} without bounds: add them" if loose else ""
        held = f"all ends and {DRAWS} draws of {self.allowed}" if self.uncertain else "its values"
        return [
            f"the travel is as sure as the system file with {held}{more}; what the file lacks, such as dry "
            "friction, a load or a stop, is unknown: begin with a part of the amplitude"
        ]

    def __call__(self, u: Array) -> list[Simulated]:
        """Simulate an experiment (samples, inputs), SI, with all systems."""
        return [self._resolved(self.systems, u[None]).of(0)]

    def keeping(self, u: Array) -> Iterator[Array]:
        """Yield those of several experiments (designs, samples, inputs), SI, that keep the limits."""
        for each in u[self._kept([self.system], u)]:
            # the first ends refuse most experiments
            if all(self._kept(some, each[None]).all() for some in (self.systems[:5], self.systems)):
                yield each

    def _kept(self, systems: Sequence[System], u: Array) -> Mask:
        """Whether every system keeps the limits, with `MARGIN` to spare, in experiments (designs,)."""
        found = [np.ones(0, bool)]
        for part in in_parts(u, systems, self.limits, STEPS[1]):
            y, watched, step = self._resolved(systems, part)
            flat = np.concatenate(watched)
            excess = self.limits.excess(flat, step, MARGIN).reshape(watched.shape[:2])
            found.append((excess.max(axis=1) == 0.0) & np.isfinite(y).all(axis=(1, 2, 3)))
        return np.concatenate(found)

    @cached_property
    def _program(self) -> Program:
        return equations(self.system, quantities(self.system, self.limits))

    def _resolved(self, systems: Sequence[System], u: Array) -> Simulated:
        """Simulate with steps so short that halves of them change no run that keeps the limits, see `_moved`.

        Long steps damp swings that the machine has. Runs that change with the shortest ones are not finite.
        """
        runs = (simulated(systems, u, self.limits, self.limits.c, n, self._program) for n in STEPS)
        coarse = next(runs)
        for fine in runs:
            moved = self._moved(coarse, fine)
            if not moved.any():
                break
            coarse = fine
        fine.watched[moved] = np.nan
        return fine

    def _moved(self, coarse: Simulated, fine: Simulated) -> Mask:
        """Whether runs (designs, sets) within the limits differ by more than `MARGIN` of a reached width."""
        designs, sets = fine.watched.shape[:2]
        found = np.zeros((designs, sets), bool)
        for k in range(sets):
            inside = self.limits.excess(fine.watched[:, k], fine.step) == 0.0
            one, other = coarse.watched[inside, k], fine.watched[inside, k, ::2]
            near = np.abs(one - other) <= MARGIN * np.ptp(other, axis=1, keepdims=True)
            found[inside, k] = ~near.all(axis=(1, 2))
        return found
