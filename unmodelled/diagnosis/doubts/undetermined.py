"""Combinations of fitted numbers that the logs do not determine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.remark import Remark, listed, quantity
from unmodelled.diagnosis.doubts.implausible import implausible
from unmodelled.diagnosis.doubts.numbers import Numbers
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.residuals import Errors
from unmodelled.effects.added import Added

#: Half the 95 % interval of a number, relative to its size, from which the logs do not determine it.
UNDETERMINED_CHANGE = 1.0
#: The same of a combination of numbers.
COMBINED_CHANGE = 0.2
#: Least change of a number in such a combination, relative to its size.
COMBINED_LEAST = 0.02
#: Least change of it in its change alone: a correlation of 0.94 of two numbers.
COMBINED_RATIO = 3.0
#: Standard errors from a number to the end of its 95 % interval.
Z = 1.96
#: Change of a number by which an exact combination is told from one near the fit, and largest exponent in it.
TRIED_FACTOR, LARGEST_EXPONENT = 1.2, 3
#: Difference up to which an exponent is a whole number, and up to which free runs are the same, in standard
#: deviations of the noise.
WHOLE, SAME = 0.05, 0.1
#: Largest standard deviation and smallest curvature, so that a number without influence can be inverted.
_HUGE, _TINY = 1e6, 1e-12
#: Standard error of a number, relative to the number, from which it has no visible influence.
_NO_INFLUENCE = 100.0


def remarks(numbers: Numbers) -> tuple[Remark, ...]:
    """Return all remarks on the numbers of a fit.

    A number that may be zero only because another one can take its place is not called zero.
    """
    loose = undetermined(numbers.fitted)
    names = {name for remark in loose for name in remark.numbers}
    first = (r for r in implausible(numbers) if r.kind != "zero" or not names & set(r.numbers))
    return (*first, *loose)


def undetermined(fitted: FittedHypothesis) -> tuple[Remark, ...]:
    """Return remarks on numbers of a fit that its logs do not determine."""
    found, effects = _determination(fitted), fitted.hypothesis.effects
    within = [next((e for e in effects if set(m) <= set(e.units)), None) for m in found.combinations]
    pairs = list(zip(found.combinations, within, strict=True))
    remarks = [combination(fitted, moves) for moves, effect in pairs if effect is None]
    for each in effects:
        names = dict.fromkeys(n for moves, effect in pairs if effect is each for n in moves)
        remarks += [_curve(each, tuple(names))] if names else []
    joint = {name for moves in found.combinations for name in moves}
    amplitudes = {n for e in effects for n in e.amplitudes}
    for name in found.names:
        if name not in joint | amplitudes and not found.determined(name):
            remarks.append(_single(found, name))
    return tuple(remarks)


@dataclass(frozen=True, eq=False)
class Determination:
    """Uncertainty of the numbers of a fit, as relative changes that its logs do not rule out.

    The size of a number is its value, or its plausible size where that is larger. Timing, numbers of single
    experiments and numbers that only smooth a corner may take any value; numbers at a bound are fixed.
    """

    fitted: FittedHypothesis
    names: tuple[str, ...]  # those of the physics first
    size: Array  # of the numbers, (names,), SI
    directions: Array  # orthogonal, (names, directions), in relative changes of the numbers
    deviations: Array  # standard deviations along the directions, (directions,)

    @classmethod
    def of(cls, fitted: FittedHypothesis) -> Determination:
        """Eliminate all other unknowns from the normal equations of a fit."""
        hypothesis, fit, unknowns = fitted.hypothesis, fitted.fit, fitted.unknowns
        reported = {n for e in hypothesis.effects for n in e.reported}
        # the mean of the deviations of the experiments is that of the parameter
        scattered = {e.place.name for e in hypothesis.effects if e.per_experiment}
        wanted = {*hypothesis.study.system.uncertain, *reported} - scattered
        fixed = {u.name for u in unknowns.each if fitted.at_bound(u.name)}
        # the other shapes of an effect without one of its parts may be those of this part
        absent = {n for e in hypothesis.effects if fixed & set(e.reported) for n in e.shapes}
        owner = [unknowns.each[k] for k in unknowns.unknown]
        mine = [k for k, u in enumerate(owner) if u.name in wanted - fixed - absent and not u.own]
        others = [k for k, u in enumerate(owner) if k not in mine and u.name not in fixed]
        curvature, gradient, _ = fit.normal.reduced()
        whole = fit.normal.summed(curvature, gradient)[0] + np.diag(fit.normal.precision)
        values = np.array([fit.values[owner[k].name] for k in mine])
        size = np.maximum(np.abs(values), unknowns.scale[mine])
        relative = size / unknowns.scale[mine]
        information = _eliminated(whole, mine, others) * np.outer(relative, relative)
        curve, directions = np.linalg.eigh(information)
        covariance = fit.covariance[np.ix_(mine, mine)] / np.outer(size, size)
        scatter = np.nan_to_num(covariance, posinf=_HUGE**2)
        windows = np.einsum("ik,ij,jk->k", directions, scatter, directions)
        variance = np.clip(np.maximum(1.0 / np.maximum(curve, _TINY), windows), 0.0, _HUGE**2)
        return cls(fitted, tuple(owner[k].name for k in mine), size, directions, np.sqrt(variance))

    @cached_property
    def information(self) -> Array:
        """Return the inverse covariance, shape (names, names), of relative changes."""
        return np.asarray((self.directions / self.deviations**2) @ self.directions.T)

    def determined(self, name: str) -> bool:
        """Return whether a number is determined, by itself and in every combination."""
        if name not in self.names:
            return bool(np.isfinite(self.fitted.fit.variance(name)))
        relative = self.error(name) / self.size[self.names.index(name)]
        alone = bool(Z * relative < UNDETERMINED_CHANGE)
        return alone and not any(name in moves for moves in self.combinations)

    def error(self, name: str) -> float:
        """Return the standard error of a number of `names`, SI."""
        k = self.names.index(name)
        return float(self.size[k] * np.sqrt(np.sum((self.directions[k] * self.deviations) ** 2)))

    @cached_property
    def combinations(self) -> tuple[Mapping[str, float], ...]:
        """Return combinations of two or more numbers that can change together."""
        found = []
        loose = Z * self.deviations >= COMBINED_CHANGE
        alone = Z / np.sqrt(np.maximum(np.diag(self.information), _TINY))
        for row in _sparse(self.directions[:, loose].T):
            moves = row * Z / np.sqrt(max(float(row @ self.information @ row), _TINY))
            tied = np.abs(moves) >= np.maximum(COMBINED_RATIO * alone, COMBINED_LEAST)
            changes = {
                name: move * size / abs(self.fitted.fit.values[name])
                for name, move, size, one in zip(self.names, moves.tolist(), self.size, tied, strict=True)
                if one and self.fitted.fit.values[name] != 0.0
            }
            if len(changes) > 1 and np.abs(moves[tied]).max() >= COMBINED_CHANGE:
                found.append(changes)
        return tuple(found)


@lru_cache(maxsize=1)
def _determination(fitted: FittedHypothesis) -> Determination:
    # asked for every number of a fit
    return Determination.of(fitted)


def _eliminated(whole: Array, mine: list[int], others: list[int]) -> Array:
    """Curvature by `mine` with all `others` at their best values (Schur complement)."""
    across, inner = whole[np.ix_(mine, others)], whole[np.ix_(others, others)]
    unit = 1.0 / np.sqrt(np.maximum(np.diag(inner), _TINY))
    inverse = np.linalg.pinv(inner * np.outer(unit, unit), rcond=_TINY, hermitian=True) * np.outer(unit, unit)
    return np.asarray(whole[np.ix_(mine, mine)] - across @ inverse @ across.T)


def _sparse(rows: Array) -> Array:
    """A basis of the space of the rows, with zeros by elimination; the largest entry of a row is one."""
    rows = rows.copy()
    for k in range(len(rows)):
        i, j = divmod(int(np.argmax(np.abs(rows[k:]))), rows.shape[1])
        rows[[k, k + i]] = rows[[k + i, k]]
        rows[k] /= rows[k, j]
        for other in range(len(rows)):
            if other != k:
                rows[other] -= rows[other, j] * rows[k]
    return np.asarray(rows / np.abs(rows).max(axis=1, keepdims=True, initial=_TINY))


def combination(fitted: FittedHypothesis, moves: Mapping[str, float]) -> Remark:
    """Say which products are determined, or how numbers can change together, by relative changes of each."""
    names = tuple(moves)
    one = "one of the two" if len(names) == 2 else "one of them"
    todo = f"measure {one} separately, or log motions that tell them apart"
    exponents = _exponents(moves)
    if exponents and _same(fitted, exponents):
        products = listed(_product(names[0], n, exponents) for n in names[1:])
        sentence = f"these logs determine only {products}, not {listed(names)} by themselves; {todo}"
    else:
        sentence = f"{_moves(fitted, moves)}, without a visible change of the error; {todo}"
    return Remark(names, "undetermined", sentence)


def _moves(fitted: FittedHypothesis, moves: Mapping[str, float]) -> str:
    """How numbers can change together."""
    (first, most), *others = moves.items()
    if len(others) > 1:
        largest = _percent(max(moves.values(), key=abs))
        return f"{listed(_label(fitted, n) for n in moves)} can change together by {largest}"
    ((second, follow),) = others
    way = "rises" if most * follow > 0.0 else "falls"
    return (
        f"{_label(fitted, first)} can rise by {_percent(most)} while {_label(fitted, second)} {way} by "
        f"{_percent(follow)}"
    )


def _percent(change: float) -> str:
    return f"{100.0 * abs(change):.2g} %" if abs(change) < 1.0 else "more than 100 %"


def _exponents(moves: Mapping[str, float]) -> dict[str, int]:
    """Relative changes as small whole numbers; none where they are not."""
    least = min(moves.values(), key=abs)
    ratios = {name: move / least for name, move in moves.items()}
    near = all(abs(r - round(r)) <= WHOLE and abs(r) < LARGEST_EXPONENT + 0.5 for r in ratios.values())
    return {name: round(r) for name, r in ratios.items()} if near else {}


def _product(first: str, other: str, exponents: Mapping[str, int]) -> str:
    """The product of powers of two numbers that stays, such as J/mgl."""
    a, b = exponents[other], exponents[first]
    if a < 0:
        a, b = -a, -b
    powers = [name if e == 1 else f"{name}^{e}" for name, e in ((first, a), (other, abs(b)))]
    return ("/" if b > 0 else "*").join(powers)


def _same(fitted: FittedHypothesis, exponents: Mapping[str, int]) -> bool:
    """Whether free runs are the same when the numbers change by powers of one factor."""
    moved, sigma = fitted.moved(fitted.recording)
    names = [u.name for u in fitted.unknowns.each]
    z = fitted.vector(fitted.unknowns)
    factor = np.ones(len(z))
    for name, exponent in exponents.items():
        factor[fitted.unknowns.unknown == names.index(name)] = TRIED_FACTOR**exponent
    errors = Errors(fitted.unknowns, sigma, fitted.fit.substeps)
    r = errors(np.stack([z, z * factor]), moved[:, None].repeat(2, axis=1))
    counted = r.swapaxes(1, 2)[fitted.recording.counted]
    return bool(np.sqrt(np.mean((counted[:, 1] - counted[:, 0]) ** 2)) <= SAME)


def _curve(added: Added, names: tuple[str, ...]) -> Remark:
    """Say that the numbers of one effect are determined together only."""
    return Remark(
        names,
        "undetermined",
        f"{added.title}: these logs determine its curve, not {listed(names)} one "
        "by one; use them together only",
    )


def _single(found: Determination, name: str) -> Remark:
    """Say that the logs do not determine a number."""
    fitted = found.fitted
    physics = {p.name: p.unit for p in fitted.hypothesis.study.system.parameters}
    unit = {**physics, **{n: unit for e in fitted.hypothesis.effects for n, unit in e.units.items()}}[name]
    value, error = fitted.fit.values[name], found.error(name)
    shown = f"{quantity(value, unit)} with a standard error of {quantity(error, unit, 2)}"
    if error > _NO_INFLUENCE * abs(value):
        shown = f"{quantity(value, unit)}, without visible influence"
    todo = f"measure {name} separately" if name in physics else "do not use this number"
    return Remark(
        (name,),
        "undetermined",
        f"these logs do not determine {_label(fitted, name)} ({shown}); {todo}, or log motions in which it "
        "matters",
    )


def _label(fitted: FittedHypothesis, name: str) -> str:
    """A number, with its effect where it has one."""
    owner = [e for e in fitted.hypothesis.effects if name in e.units]
    return f"{name} of {owner[0].title}" if owner else name
