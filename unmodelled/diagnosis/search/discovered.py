"""Laws that the library lacks, written down as a sum of few terms in position and velocity.

The terms are columns of the linear system around a fitted model (`core.equations`), chosen by the errors of
left-out experiments: no measurement is differentiated, and noise of the sensors is averaged over windows.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from unmodelled.diagnosis.core.columns import Columns
from unmodelled.diagnosis.core.equations import Equations
from unmodelled.diagnosis.core.folds import Folds
from unmodelled.diagnosis.core.path import Path
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.effects.discovered_law import LONGEST, DiscoveredLaw, formula_of, formula_terms
from unmodelled.effects.place import Place


def discovered(parent: FittedHypothesis, recording: Recording) -> Iterator[tuple[Hypothesis, Start]]:
    """Yield hypotheses with a formula in one port, and values to start a fit from.

    Of every port there are the best formulas of one, two and three terms, and all parts of the last one. A
    formula that is a law of the library is this law.
    """
    columns, system = Columns(Path.of(parent, recording)), parent.hypothesis.study.system
    for port in system.ports:
        terms, place = formula_terms(system, port, parent.hypothesis.study.scales), Place("port", port.name)
        whole = DiscoveredLaw(terms).law(columns.sites[place])
        sizes = [amplitude.scale for amplitude in whole.amplitudes.values()]
        folds = Equations.plain(columns, columns.of_law(whole, place)).folds()
        for some in _formulas(folds, len(terms)):
            larger = parent.hypothesis.plus(formula_of([terms[k] for k in some], system, port), place)
            amounts = [float(a[0]) * sizes[k] for k, a in zip(some, folds.amounts(some), strict=True)]
            names = larger.effects[-1].amplitudes
            yield larger, {**parent.fit.every, **dict(zip(names, amounts, strict=True))}


def _formulas(folds: Folds, terms: int) -> list[tuple[int, ...]]:
    """The best formula of every number of terms, and all parts of the longest."""
    best: list[tuple[int, ...]] = []
    for size in range(1, min(LONGEST, terms) + 1):
        sets = np.array(list(combinations(range(terms), size)))
        best.append(tuple(sets[int(np.argmin(folds.errors(sets).sum(1)))].tolist()))
    parts = [part for size in range(1, len(best[-1])) for part in combinations(best[-1], size)]
    return list(dict.fromkeys([*best, *parts]))
