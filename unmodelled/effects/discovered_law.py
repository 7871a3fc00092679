"""Formulas that a port can have: sums of few terms in position and velocity.

Among them is what no law of the library says, such as a damping in proportion to the squared position.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unmodelled.effects.added import DISCOVERED
from unmodelled.effects.constant_load import ConstantLoad
from unmodelled.effects.effect import PortEffect
from unmodelled.effects.formula_candidates import HIGHEST_HARMONIC, HIGHEST_POWER, Motion, Term
from unmodelled.effects.law import Law, signed
from unmodelled.effects.linear_loss import LinearLoss
from unmodelled.effects.linear_spring import LinearSpring
from unmodelled.effects.place import Site
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
    """Sum of a few smooth terms in position and velocity."""

    family = DISCOVERED
    domains = ("power", "balance")

    def __init__(self, terms: Sequence[Term]) -> None:
        self.terms = tuple(terms)
        self.variant = " + ".join(term.text("x", "v") for term in self.terms)

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


def formula_of(terms: Sequence[Term], system: System, port: Port) -> PortEffect:
    """Return the law of the library that is the sum of terms, or else a formula."""
    formula = DiscoveredLaw(terms)
    named = _LAWS.get(formula.variant, ())
    return next((law for law in named if law.suits(system, port)), formula)


def formula_terms(system: System, port: Port, scales: Scales) -> list[Term]:
    """Return terms in the coordinates of a port.

    Powers of a position are among them only where the logs come near its zero.
    """
    x = None if port.position is None else scales.of[port.position]
    near = x is not None and abs(x.middle) <= FARTHEST * x.half
    angle = port.position in {state.name for state in system.states if state.unit == "rad"}
    both = _DAMPING if near and port.velocity else ()
    place = [*(_SPRINGS if near else ()), *(_WAVES if angle else ())]
    return [Term(), *place, *both, *(_DRAG if port.velocity else ())]
