"""Sets of laws by their left-out error, and classes of sets that predict the same."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.diagnosis.core.columns import Atom
from unmodelled.diagnosis.core.comparison import signs
from unmodelled.diagnosis.core.equations import Equations
from unmodelled.diagnosis.core.folds import Folds
from unmodelled.diagnosis.core.left_out_kernels import MOST
from unmodelled.effects.place import Place
from unmodelled.effects.place_groups import FEWEST, place_groups

#: Best single laws of which all pairs with any other are scored, and all triples; sets that grow by one law.
PAIRED, TRIPLED, BEAM = 60, 25, 20
#: Share of the squared error that every number of an effect must remove; standard errors within which two
#: sets are alike.
MATERIAL, ALIKE = 0.01, 2.0
#: Error of the known physics, in standard deviations of the outputs, below which effects must be worth more.
NEGLIGIBLE = 0.01
#: Most classes, and best sets that are grouped.
CLASSES, GROUPED = 20, 400

Name = tuple[str, str, str | None, object]


@dataclass(frozen=True, eq=False)
class Scored:
    """A set of laws at places."""

    atoms: tuple[int, ...]  # numbers of the atoms
    names: frozenset[Name]  # families and places
    cost: float  # left-out squared error, a share of that without any effect, and the price of its numbers
    errors: Array  # squared errors of left-out experiments, the same shares, (experiments,)

    def is_like(self, other: Scored) -> bool:
        """Return whether errors differ by chance only (Sivula et al. 2020: few groups tell little)."""
        off = self.errors - other.errors
        error = np.sqrt(len(off)) * off.std(ddof=1) if len(off) > 1 else np.inf
        return bool(abs(off.sum()) <= ALIKE * error)


class _Level(NamedTuple):
    """Sets of the same number of units, the best first."""

    units: Indices  # (sets, n)
    costs: Array  # (sets,)
    errors: Array  # shares of the error, (sets, experiments)


@dataclass(eq=False)
class Chooser:
    """Score sets of laws; of each set of names the best shapes and variants are kept."""

    equations: Equations
    gap: float  # of the known physics, in standard deviations of the outputs

    @cached_property
    def folds(self) -> Folds:
        """Return the equations with all differences between experiments."""
        return self.equations.folds()

    @cached_property
    def unit(self) -> float:
        """Return the left-out squared error without effects and differences between experiments.

        Shares of what the differences leave would let a law of chance explain a third of it.
        """
        alike = np.zeros(len(self.equations.between), bool)
        return float(self.equations.only([]).folds(alike).errors(np.full((1, 1), -1)).sum())

    @property
    def chance(self) -> float:
        """Return the probability that the best of all laws removes as much error where nothing is missing.

        Of nothing, the left-out error of an experiment falls as often as it rises: the signs of all changes
        in an experiment are drawn together (maximum statistic, Westfall and Young 1993). An error can fall by
        no more than all of it, so that a rise counts no more than the largest fall of the experiment.
        """
        every = np.arange(len(self.units))[:, None]
        every = every[self._is_few(every)]
        nothing = self.folds.errors(np.full((1, 1), -1))
        fallen = nothing - self.folds.errors(self._atoms_of(every))
        fallen = np.maximum(fallen, -fallen.max(axis=0, initial=0.0))
        best = (fallen @ signs(fallen.shape[1]).T).max(axis=0, initial=0.0)
        return float(np.mean(best >= (1.0 - 1e-9) * best[0]))

    @cached_property
    def units(self) -> list[tuple[int, ...]]:
        """Return what is added at once: every law at a place, and a law at all places of one kind."""
        atoms, groups = self.equations.atoms, place_groups(self.equations.system)
        found, laws = [(k,) for k in range(len(atoms))], dict[object, dict[Place, int]]()
        for k, atom in enumerate(atoms):
            for number, group in enumerate(groups):
                if atom.place in group:
                    law = atom.effect.family, atom.effect.variant, number
                    laws.setdefault(law, {}).setdefault(atom.place, k)
        each = [tuple(law.values()) for law in laws.values()]
        kinds = [atoms[some[0]].place.kind for some in each]
        return found + [some for some, kind in zip(each, kinds, strict=True) if len(some) >= FEWEST[kind]]

    @cached_property
    def _names(self) -> list[frozenset[Name]]:
        return [frozenset(self.equations.atoms[a].name for a in unit) for unit in self.units]

    @cached_property
    def _explanation(self) -> Indices:
        """Number (units,) of the explanation: variants and shapes of a law at a place are one."""
        number = {names: k for k, names in enumerate(dict.fromkeys(self._names))}
        return np.array([number[names] for names in self._names], np.int64)

    @cached_property
    def _apart(self) -> Mask:
        """Whether two units are different explanations, shape (units, units)."""
        every = list(dict.fromkeys(name for names in self._names for name in names))
        has = np.array([[name in names for name in every] for names in self._names], np.float64)
        has = has.reshape(len(self._names), len(every))  # of no unit at all, too
        return np.asarray(has @ has.T == 0.0)

    @cached_property
    def singles(self) -> list[Scored]:
        """Return every law alone, the best first."""
        return [self._scored(self._single, k) for k in range(len(self._single.units))]

    def may_be_far(self, one: Scored) -> bool:
        """Return whether laws may be larger than the linear system shows."""
        return any(self.equations.atoms[a].effect.may_be_far for a in one.atoms)

    def variants(self, one: Scored) -> list[Scored]:
        """Return all variants of a law at its place, the plainest first.

        Each comes at its best shape; one with a rough shape at all that were kept.
        """
        own = np.array([k for k, names in enumerate(self._names) if names == one.names], np.int64)[:, None]
        own = own[self._is_few(own)]
        each = dict[object, Scored]()
        costs = self.folds.errors(self._atoms_of(own)).sum(1)
        for k in own[np.argsort(costs, kind="stable"), 0].tolist():
            atoms = [self.equations.atoms[a] for a in self.units[k]]
            variant = frozenset((a.key, *(a.shape.values() if a.rough else ())) for a in atoms)
            if variant not in each:
                each[variant] = self._scored(self._level(np.array([[k]], np.int64)), 0)
        return sorted(
            each.values(), key=lambda s: sum(self.equations.atoms[a].effect.complexity for a in s.atoms)
        )

    @cached_property
    def _single(self) -> _Level:
        return self._level(np.arange(len(self.units))[:, None])

    @cached_property
    def sets(self) -> list[Scored]:
        """Return the best sets of up to four laws, the best first, and the empty set."""
        best = self._single.units
        pairs = self._level(self._grown(best[:PAIRED]))
        few = np.array(list(combinations(best[:TRIPLED, 0].tolist(), 3)), np.int64).reshape(-1, 3)
        apart = self._apart[few[:, [0, 0, 1]], few[:, [1, 2, 2]]].all(1)
        triples = self._level(np.concatenate([self._grown(pairs.units[:BEAM]), few[apart]]))
        levels = self._single, pairs, triples, self._level(self._grown(triples.units[:BEAM]))
        every = [self._scored(level, k) for level in levels for k in range(min(len(level.units), GROUPED))]
        empty = self._level(np.empty((1, 0), np.int64))
        found: dict[frozenset[Name], Scored] = {}
        for one in sorted([self._scored(empty, 0), *every], key=lambda s: s.cost):
            found.setdefault(one.names, one)
        return list(found.values())

    def _grown(self, best: Indices) -> Indices:
        """Sets (sets, n + 1) with one unit more than sets of shape (sets, n)."""
        apart = self._apart[best].all(axis=1)
        one, more = np.nonzero(apart)
        return np.concatenate([best[one], more[:, None]], axis=1)

    def _level(self, sets: Indices) -> _Level:
        """Score sets of units, shape (sets, n); of each set of explanations the best one is kept."""
        allowed = self._is_few(sets)
        sets = sets[allowed]
        errors = self.folds.errors(self._atoms_of(sets)) / self.unit
        toll = MATERIAL * max(1.0, (NEGLIGIBLE / self.gap) ** 2)
        costs = errors.sum(1) + toll * self._numbers[sets].sum(1)
        order = np.argsort(costs, kind="stable")
        _, first = np.unique(np.sort(self._explanation[sets[order]], axis=1), axis=0, return_index=True)
        kept = order[np.sort(first)]
        return _Level(sets[kept], costs[kept], errors[kept])

    def _atoms_of(self, sets: Indices) -> Indices:
        """Atoms (sets, most) of sets of units (sets, n), -1 where a set has fewer."""
        return self._padded[sets].reshape(len(sets), sets.shape[1] * self._padded.shape[1])

    @cached_property
    def _padded(self) -> Indices:
        """Atoms (units, most) of every unit."""
        padded = np.full((len(self.units), max(map(len, self.units), default=1)), -1)
        for row, unit in zip(padded, self.units, strict=True):
            row[: len(unit)] = unit
        return padded

    @cached_property
    def _numbers(self) -> Array:
        """Numbers (units,) that were chosen."""
        return np.array([sum(self.equations.atoms[a].numbers for a in unit) for unit in self.units], float)

    def _is_few(self, sets: Indices) -> Mask:
        """Whether sets have few enough columns, and every law has the one beside it that it needs."""
        atoms, count = self.equations.atoms, self.equations.count
        columns = np.array([sum(int(count[a]) for a in unit) for unit in self.units], np.int64)
        few = columns[sets].sum(1) <= MOST
        needing = [k for k, unit in enumerate(self.units) if any(atoms[a].effect.beside for a in unit)]
        for row in np.flatnonzero(few & np.isin(sets, needing).any(1)).tolist():
            each = [atoms[a] for unit in sets[row].tolist() for a in self.units[unit]]
            there = {a.effect.family for a in each} | self.equations.there
            few[row] = all(not a.effect.beside or a.effect.beside & there for a in each)
        return np.asarray(few)

    def _scored(self, level: _Level, k: int) -> Scored:
        units = level.units[k].tolist()
        atoms = tuple(sorted(a for unit in units for a in self.units[unit]))
        names = frozenset().union(*(self._names[unit] for unit in units))
        return Scored(atoms, names, float(level.costs[k]), level.errors[k])

    def classes(self) -> list[list[Scored]]:
        """Group sets, the best first: one joins the first class from whose head it differs by chance only.

        A set with more laws than the head of a class only contains more, it is no twin.
        """
        found: list[list[Scored]] = []
        for one in self.sets[:GROUPED]:
            like = next((group for group in found if one.is_like(group[0])), None)
            if like is None and len(found) < CLASSES:
                found.append([one])
            elif like is not None and len(one.names) <= len(like[0].names):
                like.append(one)
        return found

    def differences(self) -> list[Atom]:
        """Return what may differ between experiments beside the path, the most evident first.

        A difference costs the logarithm of the volume that its numbers may take. The unit of the errors is
        the rest with all of them, so that a difference is worth its share of the rest.
        """
        alone, nothing = self.equations.only([]), np.full((1, 1), -1)
        rest = float(self.folds.errors(nothing).sum()) / float(alone.samples.sum())
        always = np.array([atom is None for atom in alone.between], bool)

        def cost(some: Mask) -> float:
            folds = alone.folds(some, rest)
            return float(folds.errors(nothing).sum() / rest + folds.price.sum())

        costs = {k: cost(always | (np.arange(len(always)) == k)) for k in np.flatnonzero(~always).tolist()}
        order = sorted(costs, key=lambda k: costs[k])
        return [atom for k in order if (atom := alone.between[k]) is not None]
