"""Sets of laws that a linear system proposes to fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.core.columns import Atom
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.effects.effect import Effect
from unmodelled.effects.place import Place

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Proposal:
    """A fitted hypothesis and laws that the linear system around it adds.

    Attributes:
        base: fitted hypothesis.
        atoms: laws at places, in the order in which they are added.
        amounts: their amplitudes in plausible sizes, an array of shape (amplitudes,) for each atom.
    """

    base: FittedHypothesis
    atoms: tuple[Atom, ...]
    amounts: tuple[Array, ...]

    @property
    def effect(self) -> Effect:
        """Return the last law."""
        return self.atoms[-1].effect

    @property
    def place(self) -> frozenset[tuple[str, Place]]:
        """Return families and places of all laws."""
        return frozenset((a.effect.family, a.place) for a in self.atoms)

    @property
    def key(self) -> frozenset[tuple[str, str, Place]]:
        """Return family, variant and place of every law of `hypothesis`."""
        return self.base.hypothesis.key | {a.key for a in self.atoms}

    @cached_property
    def hypothesis(self) -> Hypothesis:
        """Return the hypothesis with the laws."""
        found = self.base.hypothesis
        for atom in self.atoms:
            found = found.plus(atom.effect, atom.place)
        return found

    @property
    def starts(self) -> tuple[Start, ...]:
        """Return values to start a fit from: the linear amounts, and plausible sizes of laws with memory."""
        added = self.hypothesis.effects[-len(self.atoms) :]
        linear: dict[str, float | Mapping[str, float]] = dict(self.base.fit.every)
        full = dict(linear)
        for one, atom, amounts in zip(added, self.atoms, self.amounts, strict=True):
            if one.delays:
                (name,) = one.delays
                late = float(np.clip(amounts[0] * atom.shape["delay"], *one.bounds[name]))
                linear[name], full[name] = late, atom.shape["delay"]
                continue
            shapes = dict(zip(one.shapes, atom.shape.values(), strict=True))
            linear |= shapes
            full |= shapes
            for name, amount, scale in zip(
                one.amplitudes, amounts.tolist(), atom.scale.tolist(), strict=True
            ):
                if name not in one.shares and not one.per_experiment:
                    linear[name] = amount * scale
                    full[name] = (1.0 if amount >= 0.0 else -1.0) * scale
        return (linear, full) if any(one.memory or one.delays for one in added) else (linear,)
