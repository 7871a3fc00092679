"""How laws that are mere fits go on beyond the data that they were fitted to.

A polynomial grows beyond the travel that was seen until it tears a simulation apart, and where it falls it
feeds in energy without limit. From the edges of the data on, a law is therefore straight and does not fall.
"""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from unmodelled.effects.law import Fixed, Law, Slope
from unmodelled.effects.naming import renamed
from unmodelled.effects.place import Site
from unmodelled.effects.translation import Translation
from unmodelled.systems.model import symbol

#: Beyond the range of the data, as a part of half that range: a fit is as good there as at its ends.
MARGIN = 0.1


def continued(site: Site, law: Law) -> Law:
    """`law` with straight ends where it is a mere fit along a coordinate; other laws as they are.

    Between the edges nothing changes; the slopes beyond them are zero until `slopes` gives their values.
    """
    along = law.fitted_along
    if along is None:
        return law
    low, high, reach = f"{along}_low", f"{along}_high", MARGIN * site[along].half
    inside = {along: f"clip({along}, {low}, {high})"}
    edges = {low: Fixed(along, site[along].low - reach), high: Fixed(along, site[along].high + reach)}
    return replace(
        law,
        amplitudes={n: replace(a, adds=renamed(a.adds, inside)) for n, a in law.amplitudes.items()},
        fixed={**law.fixed, **edges},
        slopes={
            f"k_{low}": Slope(f"min({along} - {low}, 0)", low),
            f"k_{high}": Slope(f"max({along} - {high}, 0)", high),
        },
    )


def slopes(law: Law, words: Translation) -> dict[str, sp.Expr]:
    """Slopes of a law at its edges in terms of its other numbers, by their names in the system.

    Args:
        law: as it was before it was continued. words: of the continued law.
    """
    names, along = words.names, law.fitted_along
    if along is None:
        return {}
    x = sp.Dummy(along, real=True)
    quantities = {**words.site.quantities, along: replace(words.site.quantities[along], expression=x)}
    local = replace(words, site=replace(words.site, quantities=quantities))
    each = (symbol(names[n]) * sp.diff(local.value(a.adds).expression, x) for n, a in law.amplitudes.items())
    slope = sum(each, sp.S.Zero)
    ends = words.law.slopes.items()
    return {names[n]: slope.xreplace({x: symbol(names[end.edge])}) for n, end in ends}


def extent(words: Translation) -> dict[str, tuple[str, str]]:
    """The coordinate of a continued law and the parameters that hold its edges, as the system calls them."""
    edges = [words.names[end.edge] for end in words.law.slopes.values()]
    return {words.text(str(words.law.fitted_along)): (edges[0], edges[1])} if edges else {}
