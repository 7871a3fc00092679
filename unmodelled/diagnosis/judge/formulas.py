"""A formula in position and speed of a port: a law that the library lacks, grown term by term."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import comb

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.columns.columns import Atom
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.refit import Parent, Refit, refit
from unmodelled.diagnosis.judge.scan import Row, removed
from unmodelled.effects.discovered_law import LONGEST, DiscoveredLaw, formula_of, formula_terms
from unmodelled.effects.formula_candidates import Term
from unmodelled.effects.place import Place
from unmodelled.systems.model import Port


def formulas(parent: Parent) -> Iterator[Refit]:
    """Yield formulas of one, two, three terms in the port where one term explains most.

    Terms are added as long as they pay, each chosen around the fit with those before it: far from the truth,
    the columns of a speed and of its square are hard to tell apart. A formula pays for the number of formulas
    of its length. A sum of laws of the library is none: these are compared one after the other.
    """
    study = parent.around.columns.path.hypothesis.study
    ports = [(port, formula_terms(study.system, port, study.scales)) for port in study.system.ports]
    first = [(port, terms, *_gains(parent.around, port, terms)) for port, terms in ports]
    if not first:
        return
    port, terms, gains, steps = max(first, key=lambda one: float(one[2].max()))
    chosen, amounts, nats = list[int](), np.zeros(len(terms)), 0.0
    while True:
        best = int(np.argmax(gains))
        amounts[best] = steps[best]
        chosen = sorted([*chosen, best])
        some, many = [terms[k] for k in chosen], comb(len(terms), len(chosen))
        one = _fitted(parent, port, some, amounts[chosen], many)
        if one is None or one.nats < nats:
            return
        if any(isinstance(formula_of([term], study.system, port), DiscoveredLaw) for term in some):
            yield one
        if len(chosen) == min(LONGEST, len(terms)):
            return
        amounts[chosen] = [one.numbers[name][0] for name in one.added.amplitudes] / one.row.atom.scale
        nats = one.nats
        gains, steps = _gains(parent.beside(one).around, port, terms)
        gains[chosen] = -np.inf


def _gains(around: Linearised, port: Port, terms: Sequence[Term]) -> tuple[Array, Array]:
    """Squared residual that every term removes alone, and its amount in plausible sizes, (terms,) each."""
    place, any_sign = Place("port", port.name), np.zeros(1, np.bool_)
    columns = around.columns.of_law(DiscoveredLaw(terms).law(around.columns.sites[place]), place)
    G = around.reduced(around.products(columns))[around.sigma].products
    each = [removed(G, np.array([k]), any_sign) for k in range(len(terms))]
    return np.array([gain for gain, _ in each]), np.array([float(amount[0]) for _, amount in each])


def _fitted(parent: Parent, port: Port, terms: Sequence[Term], amounts: Array, formulas: int) -> Refit | None:
    """A formula refitted; None where it cannot be."""
    place, law = Place("port", port.name), DiscoveredLaw(terms)
    amplitudes = law.law(parent.around.columns.sites[place]).amplitudes.values()
    scale, any_sign = np.array([a.scale for a in amplitudes]), np.zeros(len(terms), np.bool_)
    row = Row(Atom(law, place, {}, scale, any_sign, len(terms)), formulas, np.nan, amounts)
    return refit(parent, row)
