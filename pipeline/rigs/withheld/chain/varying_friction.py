"""Friction that is not the same in every run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.chain.part import Names, VaryingPart
from pipeline.rigs.withheld.effects.effect import Effect, Port
from pipeline.rigs.withheld.effects.friction import DryFriction
from pipeline.rigs.withheld.machine import Machine


@dataclass
class _Varied(DryFriction):
    """Dry friction times `factor` (n,)."""

    inner: DryFriction
    factor: Array

    def limit(self, port: Port) -> Array:
        return self.factor * self.inner.limit(port)

    @property
    def parameters(self) -> dict[str, Any]:
        """Those of the mean friction."""
        return self.inner.parameters


@dataclass(frozen=True)
class VaryingFriction(VaryingPart):
    """Known damping, and planted dry friction, are larger by the share `excess`[i] in run i, mean zero."""

    @property
    def _factor(self) -> Array:
        return 1.0 + np.array(self.excess)

    def machine(self, machine: Machine) -> Machine:
        damping = {name: getattr(machine, name) * self._factor for name in machine.friction}
        varied: Machine = replace(machine, **damping)  # type: ignore[type-var]
        return varied

    def effect(self, effect: Effect) -> Effect:
        return _Varied(effect, self._factor) if isinstance(effect, DryFriction) else effect

    def names(self, machine: Machine, logged: tuple[str, ...]) -> Names:
        return tuple(("scatter", port) for port in sorted(set(machine.friction.values())))
