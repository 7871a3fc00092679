"""Dry friction over an integration step: a port that friction holds stays where it is.

The corner tanh(v/v_c) of dry friction is stiff: an explicit step overshoots where friction would stop the port
within the step. Such a corner is taken where the step would end instead (Moreau 1988; for the laws of dry
friction see Armstrong-Helouvry, Dupont and Canudas de Wit 1994). Friction then balances all other efforts
while they are smaller than its level, as a sticking state does (Karnopp 1985), without events and with
derivatives. Corners that the step resolves are left alone, to the last digit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import sympy as sp

from unmodelled.systems.functions import absolute, maximum, minimum, sanitised, sgn
from unmodelled.systems.procedure import Procedure, Step, evaluated

#: Length of the integration step in s, zero where nothing is integrated; the space keeps it apart from all
#: names of systems.
STEP = sp.Symbol("integration step", real=True)
#: How many times sharper than a step resolves a corner can be until its shape goes over into a cut straight
#: line: nobody sees the shape then.
SHARP = 10


@lru_cache(maxsize=256)
def held(states: tuple[sp.Symbol, ...], rates: tuple[sp.Expr, ...]) -> tuple[sp.Expr, ...]:
    """Return rates whose stiff corners tanh(z) are taken at the end of a step of length `STEP`.

    Of z' = s - k*tanh(z), the excess of h*k over one is taken where the step h ends: the linear part of the
    rates is then never faster than 1/h. Corners that act on each other, such as of the joints of an arm, are
    solved one after the other (Gauss and Seidel).

    Args:
        states: states of the equations.
        rates: their time derivatives, with the laws of all ports inserted.

    Returns:
        Rates, the same ones where no corner slows its own argument.
    """
    moving = set(states)
    corners = sorted(
        {c for f in rates for c in f.atoms(sp.tanh) if c.free_symbols & moving}, key=sp.default_sort_key
    )
    if not corners:
        return rates
    values = {c: sp.Dummy(real=True) for c in corners}
    flat = [f.xreplace(values) for f in rates]
    speeds = {c: _rate(c.args[0], states, flat) for c in corners}
    own = {c: -sanitised(sp.diff(speeds[c], values[c])) for c in corners}
    stiff = [c for c in corners if own[c] != 0 and not own[c].free_symbols & {*values.values()}]
    return tuple(f.xreplace(_at_the_end(stiff, values, speeds)) for f in rates) if stiff else rates


def _rate(z: sp.Expr, states: Sequence[sp.Symbol], rates: Sequence[sp.Expr]) -> sp.Expr:
    slopes = (
        (sanitised(sp.diff(z, x)), f) for x, f in zip(states, rates, strict=True) if x in z.free_symbols
    )
    return sum((slope * f for slope, f in slopes), sp.S.Zero)


def _at_the_end(
    corners: Sequence[sp.Expr], values: Mapping[sp.Expr, sp.Symbol], speeds: Mapping[sp.Expr, sp.Expr]
) -> dict[sp.Expr, sp.Expr]:
    """Return the value of every corner at the end of a step."""
    given: dict[sp.Symbol, sp.Expr] = {STEP: STEP}
    steps: list[Step] = []
    found: dict[sp.Expr, sp.Symbol] = {}

    def named(name: str, value: sp.Expr, into: dict[sp.Symbol, sp.Expr] | list[Step]) -> sp.Symbol:
        symbol = sp.Symbol(f"_{name}", real=True)
        if isinstance(into, dict):
            into[symbol] = value
        else:
            into.append((symbol, value))
        return symbol

    now = {value: corner for corner, value in values.items()}
    without = {values[c]: sp.S.Zero for c in corners}
    z = [named(f"z_{i}", c.args[0], given) for i, c in enumerate(corners)]
    s, k = [], []
    for i, c in enumerate(corners):
        yields = [-sanitised(sp.diff(speeds[c], values[d])).xreplace(now) for d in corners]
        k.append([named(f"k_{i}_{j}", v, given) if v != 0 else v for j, v in enumerate(yields)])
        s.append(named(f"s_{i}", speeds[c].xreplace(without).xreplace(now), given))
    for i, c in enumerate(corners):
        others = (k[i][j] * found.get(d, sp.tanh(z[j])) for j, d in enumerate(corners) if j != i)
        free = s[i] - sum(others, sp.S.Zero)
        wide = named(f"wide_{i}", maximum(STEP * k[i][i], sp.S.One), steps)
        # the step by which the corner is implicit: none where k*STEP is one
        right = named(f"right_{i}", z[i] + STEP * (1 - 1 / wide) * free, steps)
        cut = named(f"cut_{i}", maximum(minimum(right / wide, sp.S.One), sp.S.NegativeOne), steps)
        # end + (wide - 1)*tanh(end) = right by one step of Newton's method from below
        end = sgn(right) * maximum(absolute(right) / wide, absolute(right) - (wide - 1))
        before = named(f"end_{i}", end, steps)
        value = named(f"tanh_{i}", sp.tanh(before), steps)
        end = before - (before + (wide - 1) * value - right) / (1 + (wide - 1) * (1 - value**2))
        share = minimum(SHARP / wide, sp.S.One)
        found[c] = named(f"value_{i}", cut + share * (sp.tanh(end) - cut), steps)
    return {c: evaluated.at(Procedure(given, steps, value), given) for c, value in found.items()}
