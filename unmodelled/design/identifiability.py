"""Identifiability of parameters together with networks in the ports (section 4.4.4, appendix 4.7).

Collinearity index: Brun, Reichert, Kuensch, Practical identifiability analysis of large environmental
simulation models, Water Resources Research 37 (2001).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.linalg import orth

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.design.absorption import beside_networks
from unmodelled.design.sensitivity import Sensitivity, sensitivity
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Names = tuple[str, ...]

#: Stands for exactly collinear, which rounding hides.
COLLINEAR = 1e6
#: Share of a column's energy; if networks leave less, they have absorbed it.
ABSORBED = 0.01
#: Share of the limit of the collinearity that two parameters alone may use up: others of a set add to it.
SHARE_OF_TWO = 2.0 / 3.0
LARGEST_SET = 4
MOST = 10


@dataclass(frozen=True)
class ParameterSet:
    """Set of parameters with the verdict whether they can be identified together."""

    names: Names
    collinearity: float  # of the columns of parameters and efforts (the text's view), 1 or more
    collinearity_with_network: float  # of the parameters' columns without what networks absorb
    identifiable: bool  # by the first index and the sensitivities
    with_network: bool  # by the second index and the sensitivities
    maximal: bool = False  # both allow it, and no larger set contains this one

    @property
    def both(self) -> bool:
        """Whether both views allow the identification."""
        return self.identifiable and self.with_network


@dataclass(frozen=True)
class Identifiability:
    """Analysis of a sensitivity matrix."""

    found: Sensitivity
    left: Array  # (rows, parameters), parameters' columns without what networks in the ports absorb
    limit: float  # of the collinearity index
    floor: float  # smallest sensitivity that counts, as a share of the largest, at most 1

    @cached_property
    def correlation(self) -> Array:
        """Correlations (columns, columns), efforts first (the text's Q); zero for a zero column."""
        return _correlation(self.found.matrix)

    @cached_property
    def left_correlation(self) -> Array:
        """Correlations (parameters, parameters) of `left`."""
        return _correlation(self.left)

    @cached_property
    def norms(self) -> dict[str, float]:
        """Sensitivity to every effort and parameter by name, dimensionless."""
        names = (*self.found.efforts, *self.found.parameters)
        return dict(zip(names, self.found.norms.tolist(), strict=True))

    @cached_property
    def unabsorbed(self) -> dict[str, float]:
        """Share of the energy of each parameter's column that networks do not absorb, 0 to 1, by name."""
        energy = np.mean(self.found.matrix[:, len(self.found.efforts) :] ** 2, 0)
        share = np.mean(self.left**2, 0) / np.where(energy > 0.0, energy, 1.0)
        return dict(zip(self.found.parameters, np.minimum(share, 1.0).tolist(), strict=True))

    @property
    def correlated(self) -> float:
        """Correlation above which two parameters must be separated; 0.91 for a limit of 5."""
        return correlated(self.limit)

    @cached_property
    def sensitive(self) -> Names:
        """Names of the parameters whose sensitivity reaches the floor."""
        # a gear ratio between terms that cancel can dwarf the others; 1 changes the derivatives by their size
        largest = min(max(self.norms[p] for p in self.found.parameters), 1.0)
        return tuple(
            p for p in self.found.parameters if self.norms[p] > 0.0 and self.norms[p] >= self.floor * largest
        )

    @cached_property
    def absorbed(self) -> Names:
        """Names of the parameters that networks absorb."""
        return tuple(
            p for p in self.found.parameters if self.norms[p] > 0.0 and self.unabsorbed[p] < ABSORBED
        )

    @cached_property
    def compared(self) -> Names:
        """Names of the most sensitive parameters, in the order of the file; only these form sets."""
        moving = [p for p in self.found.parameters if self.norms[p] > 0.0]
        most = sorted(moving, key=lambda p: -self.norms[p])[:MOST]
        return tuple(p for p in moving if p in most)

    @cached_property
    def sets(self) -> tuple[ParameterSet, ...]:
        """All sets of up to four of the compared parameters, the best first.

        Maximal identifiable sets come first, then other identifiable ones; large before small, then by the
        product of the sensitivities over the collinearity.
        """
        names = [k for size in range(1, LARGEST_SET + 1) for k in combinations(self.compared, size)]
        judged = [self.judge(k) for k in names]
        good = [{*s.names} for s in judged if s.both]
        ranked = [
            replace(s, maximal=s.both and not any({*s.names} < other for other in good)) for s in judged
        ]
        return tuple(sorted(ranked, key=self._rank))

    def judge(self, names: Names) -> ParameterSet:
        """Judge whether parameters can be identified together."""
        at = [self.found.parameters.index(n) for n in names]
        efforts = len(self._with_efforts) - len(self.found.parameters)
        alone = collinearity(self._with_efforts, [*range(efforts), *(efforts + k for k in at)])
        beside = COLLINEAR if {*names} & {*self.absorbed} else collinearity(self.left_correlation, at)
        fit = {*names} <= {*self.sensitive} and not any(
            abs(self.correlation_of(a, b)) > self.correlated for a, b in combinations(names, 2)
        )
        return ParameterSet(names, alone, beside, fit and alone < self.limit, fit and beside < self.limit)

    @cached_property
    def _with_efforts(self) -> Array:
        """Correlations with a basis of the efforts, so that similar efforts do not count as collinear."""
        efforts, others = np.split(self.found.matrix, [len(self.found.efforts)], axis=1)
        basis = orth(_normalised(efforts), 1e-9) if efforts.size else efforts
        return _correlation(np.hstack([basis, others]))

    def correlation_of(self, a: str, b: str) -> float:
        """Return an entry of the correlation matrix."""
        names = list(self.norms)
        return float(self.correlation[names.index(a), names.index(b)])

    def left_correlation_of(self, a: str, b: str) -> float:
        """Return the correlation of two parameters without what networks absorb."""
        return float(self.left_correlation[self.found.parameters.index(a), self.found.parameters.index(b)])

    def _rank(self, s: ParameterSet) -> tuple[bool, bool, int, float]:
        worth = float(np.prod([self.norms[n] for n in s.names]))
        worst = max(s.collinearity, s.collinearity_with_network)
        return not s.maximal, not s.both, -len(s.names), -worth / worst


def identify_sets(
    system: System,
    logs: Logs,
    parameters: Sequence[str] | None = None,
    limit: float = 5.0,
    floor: float = 0.05,
) -> Identifiability:
    """Analyse which parameters can be identified together, alone and beside networks in the ports."""
    if not limit > 1.0:
        raise BadInput(f"limit must be larger than 1, got {limit:g}")
    if not 0.0 <= floor < 1.0:
        raise BadInput(f"floor must be at least 0 and less than 1, got {floor:g}")
    found = sensitivity(system, logs, parameters)
    efforts = len(found.efforts)
    gains = list(found.matrix[:, :efforts].T)
    left = beside_networks(found.matrix[:, efforts:], gains, found.inputs)
    return Identifiability(found, left, float(limit), float(floor))


def correlated(limit: float) -> float:
    """Return the correlation above which two columns must be separated.

    Examples:
        >>> round(correlated(5.0), 2)
        0.91
    """
    return 1.0 - 1.0 / (SHARE_OF_TWO * limit) ** 2


def collinearity(correlation: Array, columns: Sequence[int]) -> float:
    """Compute the collinearity index of some columns: 1 for orthogonal ones, `COLLINEAR` for dependent ones.

    A column keeps 1/index of its size after the best compensation by the others. Takes correlation (columns,
    columns).
    """
    smallest = float(np.linalg.eigvalsh(correlation[np.ix_(columns, columns)])[0])
    return float(1.0 / np.sqrt(max(smallest, COLLINEAR**-2)))


def _normalised(columns: Array) -> Array:
    norm = np.linalg.norm(columns, axis=0)
    return np.asarray(columns / np.where(norm > 0.0, norm, 1.0))


def _correlation(columns: Array) -> Array:
    unit = _normalised(columns)
    return unit.T @ unit
