"""Experiments on one clock, and the event and the uncertain parameters that a simulation looks at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput, closest
from unmodelled.systems.model import Event, System


@dataclass(frozen=True)
class Experiments:
    """Experiments on one clock: inputs, operating points and initial states."""

    u: Array  # (L, T, inputs), sampled every `period`, linear in between
    period: float  # sampling period, s
    c: Array  # (L, constants), operating points
    x0: Array  # (L, states), at t = 0

    def __post_init__(self) -> None:
        if not (self.u.ndim == 3 and self.c.ndim == self.x0.ndim == 2):
            raise ValueError(f"u, c, x0 of shapes {self.u.shape}, {self.c.shape}, {self.x0.shape}")
        if not len(self.u) == len(self.c) == len(self.x0):
            raise ValueError(f"{len(self.u)} inputs, {len(self.c)} constants and {len(self.x0)} starts")
        for name, values in (("input", self.u), ("operating point", self.c), ("start", self.x0)):
            for i in np.flatnonzero(~np.isfinite(values).reshape(len(values), -1).all(axis=1))[:1]:
                raise BadInput(
                    f"experiment {i + 1}: the {name} has a value that is not finite: correct its log"
                )
        if not 0.0 < self.period < np.inf:
            raise BadInput(f"period must be a positive number of seconds, got {self.period}")

    def __len__(self) -> int:
        return len(self.u)

    def only(self, members: Sequence[int] | Indices) -> Experiments:
        """Return some of the experiments, members (K,)."""
        return replace(self, u=self.u[members], c=self.c[members], x0=self.x0[members])

    def input(self, t: Array | float) -> Array:
        """Return inputs (..., L, inputs) at times t (..., L), linear in between and held beyond the ends."""
        last = self.u.shape[1] - 1
        place = np.clip(np.asarray(t) / self.period, 0.0, last)
        k = np.minimum(place.astype(np.int64), max(0, last - 1))
        row = np.arange(len(self))
        now, then = self.u[row, k], self.u[row, np.minimum(k + 1, last)]
        return np.asarray(now + (place - k)[..., None] * (then - now))

    def steps(self, step: float) -> int:
        """Return the number of integration steps that fit into the logs."""
        periods = round(step / self.period) if 0.0 < step < np.inf else 0
        if periods < 1 or abs(periods * self.period - step) > 1e-6 * self.period:
            raise BadInput(f"step must be a multiple of the period {self.period:g} s, got {step}")
        return int((self.u.shape[1] - 1) // periods)


def event_named(system: System, name: str) -> Event:
    """Return an event of a system by its name."""
    events = {e.name: e for e in system.events}
    if name not in events:
        hint = closest(name, events) if events else ""
        raise BadInput(f"system {system.name}: has no event {name!r}{hint}")
    return events[name]


def uncertain_indices(system: System, uncertain: Sequence[str]) -> list[int]:
    """Return the indices of parameters by their names."""
    names = [p.name for p in system.parameters]
    for k, name in enumerate(uncertain):
        if name not in names:
            hint = closest(name, names) if names else ""
            raise BadInput(f"system {system.name}: has no parameter {name!r}{hint}")
        if name in uncertain[:k]:
            raise BadInput(f"system {system.name}: parameter {name!r} is named twice: name it once")
        if system.values[names.index(name)] == 0.0:
            raise BadInput(
                f"system {system.name}: parameter {name!r} is zero, and so is every multiple of it: "
                "give it another value, or hold it fixed"
            )
    return [names.index(name) for name in uncertain]
