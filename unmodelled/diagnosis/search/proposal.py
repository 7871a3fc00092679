"""Sets of laws that a linear system proposes to fit, and short fits over few windows, which rank them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.core.choose import Chooser, Scored
from unmodelled.diagnosis.core.columns import Atom
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.effects.place import Place

#: Share of the windows over which many numbers at once are fitted first.
BEGUN = 0.1
#: Iterations of that, and of a short fit: a budget.
BEGINNING, ITERATIONS = 8, 3


@dataclass(frozen=True, eq=False)
class Proposal:
    """A fitted hypothesis and laws that the linear system around it adds."""

    base: FittedHypothesis
    atoms: tuple[Atom, ...]  # in the order in which they are added
    amounts: tuple[Array, ...]  # amplitudes (amplitudes,) of each atom, in plausible sizes

    @classmethod
    def of(cls, base: FittedHypothesis, chooser: Chooser, one: Scored) -> Proposal:
        """Return a scored set with its linear amounts; a law that needs another one comes after it."""
        atoms = [chooser.equations.atoms[a] for a in one.atoms]
        amounts = chooser.folds.amounts(one.atoms)
        # what a law needs of the system, such as the speed at an input, may be gone behind a simpler one
        needs = [(bool(atom.effect.beside), -atom.effect.complexity) for atom in atoms]
        order = sorted(range(len(atoms)), key=lambda k: needs[k])
        return cls(base, tuple(atoms[k] for k in order), tuple(amounts[k] for k in order))

    @property
    def is_single(self) -> bool:
        """Return whether it adds one law, at one place or at all places of one kind."""
        return len({(a.effect.family, a.effect.variant) for a in self.atoms}) == 1

    @property
    def rough(self) -> tuple[float, ...]:
        """Return the values of shapes with many optima, from each of which another fit may begin."""
        return tuple(value for a in self.atoms if a.rough for value in a.shape.values())

    @property
    def is_possible(self) -> bool:
        """Return whether the place of every law is still there when those before it are added."""
        found = self.base.hypothesis
        for atom in self.atoms:
            if atom.place.everywhere not in found.places(atom.effect):
                return False
            found = found.plus(atom.effect, atom.place)
        return True

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
        every = {added.key: added for added in self.hypothesis.effects}
        added = [every[atom.key] for atom in self.atoms]
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


@dataclass(frozen=True, eq=False)
class ShortFits:
    """Short fits of candidates."""

    known: FittedHypothesis
    recording: Recording  # few windows

    def of(self, proposal: Proposal) -> LeftOut:
        """Return the left-out predictions of a proposal after a short fit."""
        substeps, larger, starts = proposal.base.fit.substeps, proposal.hypothesis, proposal.starts
        if len(proposal.atoms) > 1:
            # many numbers at once begin with short free runs, as the known physics does
            shorter = self.recording.shortened(BEGUN)
            begun = FittedHypothesis.of(larger, shorter, starts, BEGINNING, substeps)
            starts = (begun.fit.every,)
        return LeftOut.of(FittedHypothesis.of(larger, self.recording, starts, ITERATIONS, substeps))

    def again(self, fitted: FittedHypothesis) -> LeftOut:
        """Return the left-out predictions of a hypothesis that is fitted again, like the proposals."""
        return self._again(fitted) if fitted.hypothesis.effects else self._without

    @cached_property
    def _without(self) -> LeftOut:
        """The known physics, fitted like the proposals."""
        return self._again(self.known)

    def _again(self, fitted: FittedHypothesis) -> LeftOut:
        start, substeps = fitted.fit.every, fitted.fit.substeps
        return LeftOut.of(
            FittedHypothesis.of(fitted.hypothesis, self.recording, [start], ITERATIONS, substeps)
        )
