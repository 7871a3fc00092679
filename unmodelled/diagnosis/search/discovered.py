"""Laws that the library lacks, written down as a sum of few terms in position and velocity.

The terms are columns of the linear system around a fitted model (`core.equations`), chosen by the errors of
left-out experiments: no measurement is differentiated, and noise of the sensors is averaged over windows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from unmodelled.diagnosis.core.columns import Columns
from unmodelled.diagnosis.core.equations import Equations
from unmodelled.diagnosis.core.folds import Folds
from unmodelled.diagnosis.core.path import Path
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.effects.added import DISCOVERED
from unmodelled.effects.constant_load import ConstantLoad
from unmodelled.effects.effect import PortEffect
from unmodelled.effects.formula_candidates import HIGHEST_HARMONIC, HIGHEST_POWER, Motion, Term
from unmodelled.effects.law import Law, signed
from unmodelled.effects.linear_loss import LinearLoss
from unmodelled.effects.linear_spring import LinearSpring
from unmodelled.effects.place import Place, Site
from unmodelled.effects.quadratic_drag import QuadraticDrag
from unmodelled.effects.scales import Scales
from unmodelled.effects.viscous_friction import ViscousFriction
from unmodelled.systems.model import Port, System

#: Terms of the longest formula, and largest power of a position that a damping is in proportion to.
LONGEST, DAMPED_POWER = 3, 2
#: Largest distance of zero from the middle of the logged positions, in halves of their range, at which powers
#: of a position are tried: the fifth power of a temperature of 290 K to 300 K is no law.
FARTHEST = 3.0

_SPRINGS = tuple(Term(power=k) for k in range(1, HIGHEST_POWER + 1))
_WAVES = tuple(Term(harmonic=k) for k in range(-HIGHEST_HARMONIC, HIGHEST_HARMONIC + 1) if k)
_DAMPING = tuple(Term(Motion.VISCOUS, k) for k in range(1, DAMPED_POWER + 1))
_DRAG = tuple(map(Term, (Motion.VISCOUS, Motion.QUADRATIC, Motion.CUBIC)))
#: Laws of the library that are a single term.
_LAWS: dict[str, tuple[PortEffect, ...]] = {
    "1": (ConstantLoad(),),
    "x": (LinearSpring(), LinearLoss()),
    "v": (ViscousFriction(),),
    "v*abs(v)": (QuadraticDrag(),),
}
_TERMS = {term.text("x", "v"): term for term in (Term(), *_SPRINGS, *_WAVES, *_DAMPING, *_DRAG)}


class DiscoveredLaw(PortEffect):
    """Sum of a few smooth terms in position and velocity.

    It has as many numbers as terms, and was chosen among many formulas: its complexity is one more than that.
    """

    family = DISCOVERED
    domains = ("power", "balance")

    def __init__(self, terms: Sequence[Term]) -> None:
        self.terms = tuple(terms)
        self.variant = " + ".join(term.text("x", "v") for term in self.terms)
        self.complexity = 1.0 + len(self.terms)

    @classmethod
    def named(cls, variant: str) -> DiscoveredLaw:
        """Return the law with a variant, as an answer names it."""
        return cls([_TERMS[text] for text in variant.split(" + ")])

    def law(self, at: Site) -> Law:
        names = [f"c_{k}" for k in range(1, len(self.terms) + 1)]
        typical = [np.array(at[local].rms if local in at else 1.0) for local in ("x", "v")]
        texts = [term.text("x", "v") for term in self.terms]
        sizes = [at.effort / float(np.abs(term(*typical))) for term in self.terms]
        products = [
            name if text == "1" else f"{name}*{text}" for name, text in zip(names, texts, strict=True)
        ]
        each = zip(names, texts, sizes, strict=True)
        return Law(" + ".join(products), {name: signed(text, size) for name, text, size in each})


def discovered(parent: FittedHypothesis, recording: Recording) -> Iterator[tuple[Hypothesis, Start]]:
    """Yield hypotheses with a formula in one port, and values to start a fit from.

    Of every port there are the best formulas of one, two and three terms, and all parts of the last one. A
    formula that is a law of the library is this law.
    """
    columns, system = Columns(Path.of(parent, recording)), parent.hypothesis.study.system
    for port in system.ports:
        terms, place = _terms(system, port, parent.hypothesis.study.scales), Place("port", port.name)
        whole = DiscoveredLaw(terms).law(columns.sites[place])
        sizes = [amplitude.scale for amplitude in whole.amplitudes.values()]
        folds = Equations.plain(columns, columns.of_law(whole, place)).folds()
        for some in _formulas(folds, len(terms)):
            larger = parent.hypothesis.plus(_law([terms[k] for k in some], system, port), place)
            amounts = [float(a[0]) * sizes[k] for k, a in zip(some, folds.amounts(some), strict=True)]
            names = larger.effects[-1].amplitudes
            yield larger, {**parent.fit.every, **dict(zip(names, amounts, strict=True))}


def _law(terms: Sequence[Term], system: System, port: Port) -> PortEffect:
    """The law of the library that is the sum of terms, or else a formula."""
    formula = DiscoveredLaw(terms)
    named = _LAWS.get(formula.variant, ())
    return next((law for law in named if law.suits(system, port)), formula)


def _formulas(folds: Folds, terms: int) -> list[tuple[int, ...]]:
    """The best formula of every number of terms, and all parts of the longest."""
    best: list[tuple[int, ...]] = []
    for size in range(1, min(LONGEST, terms) + 1):
        sets = np.array(list(combinations(range(terms), size)))
        best.append(tuple(sets[int(np.argmin(folds.errors(sets).sum(1)))].tolist()))
    parts = [part for size in range(1, len(best[-1])) for part in combinations(best[-1], size)]
    return list(dict.fromkeys([*best, *parts]))


def _terms(system: System, port: Port, scales: Scales) -> list[Term]:
    """Terms in the coordinates of a port; powers of a position only where the logs come near its zero."""
    x = None if port.position is None else scales.of[port.position]
    near = x is not None and abs(x.middle) <= FARTHEST * x.half
    angle = port.position in {state.name for state in system.states if state.unit == "rad"}
    both = _DAMPING if near and port.velocity else ()
    place = [*(_SPRINGS if near else ()), *(_WAVES if angle else ())]
    return [Term(), *place, *both, *(_DRAG if port.velocity else ())]
