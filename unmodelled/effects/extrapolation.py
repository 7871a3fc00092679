"""Extrapolation of fitted curves beyond the data: linear, and never falling.

A polynomial grows without limit outside the fitted range, and where it falls it feeds energy into the
simulation. From the edges of the data on, such a law is therefore continued as a straight line.
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
    """Return a law that is continued linearly beyond the data, if it is a fitted curve.

    The slopes beyond the edges are zero until `slopes` gives their values.
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
    """Return the slopes of a law at the edges of the data, in terms of its other parameters."""
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
    """Return the coordinate of a continued law and the parameters that hold the edges of the data."""
    edges = [words.names[end.edge] for end in words.law.slopes.values()]
    return {words.text(str(words.law.fitted_along)): (edges[0], edges[1])} if edges else {}
