"""Dry friction over an integration step: a port that friction holds stays where it is.

The corner tanh(v/v_c) of dry friction is stiff: an explicit step overshoots where friction would stop the
port within the step. The part of such a corner that a step cannot resolve is taken where the step ends.
Friction then balances all other efforts while they are smaller than its level, as a sticking state does
(Karnopp 1985; Armstrong-Helouvry, Dupont and Canudas de Wit 1994), without events, and with derivatives.
Corners that the step resolves are left alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import sympy as sp

from unmodelled.systems.functions import absolute, maximum, minimum, sanitised, sgn
from unmodelled.systems.procedure import Procedure, Step, evaluated

#: Length of the integration step in s, zero where nothing is integrated; the space keeps it apart from all
#: names of systems.
STEP_LENGTH = sp.Symbol("integration step", real=True)
#: How many times sharper than a step resolves a corner can be until its shape goes over into a cut straight
#: line: nobody sees the shape then.
SHARP = 10


@lru_cache(maxsize=256)
def held(states: tuple[sp.Symbol, ...], rates: tuple[sp.Expr, ...]) -> tuple[sp.Expr, ...]:
    """Return rates whose stiff corners tanh(z) are taken at the end of a step of length `STEP_LENGTH`.

    Of z' = s - k*tanh(z), the excess of h*k over one is taken where the step h ends: the linear part of the
    rates is then never faster than 1/h. Corners that act on each other, such as of the joints of an arm, are
    solved one after the other (Gauss and Seidel). Friction on what moves by itself is left alone. The rates
    have the laws of all ports inserted; they are the same where no corner slows its own argument.
    """
    # a corner holds at rest: the neurons of a network, with their biases, are none
    moving, rest = set(states), dict.fromkeys(states, sp.S.Zero)
    every = {c for f in rates for c in f.atoms(sp.tanh) if c.free_symbols & moving}
    corners = sorted((c for c in every if c.args[0].xreplace(rest) == 0), key=sp.default_sort_key)
    if not corners:
        return rates
    values = {c: sp.Dummy(real=True) for c in corners}
    flat = [f.xreplace(values) for f in rates]
    speeds = {c: _rate(c.args[0], states, flat) for c in corners}
    own = {c: -sanitised(sp.diff(speeds[c], values[c])) for c in corners}
    stiff = [c for c in corners if own[c] != 0 and not own[c].free_symbols & {*values.values()}]
    if not stiff:
        return rates
    ends = _at_the_end(stiff, values, speeds)
    return tuple(f.xreplace(ends) for f in rates)


def _rate(z: sp.Expr, states: Sequence[sp.Symbol], rates: Sequence[sp.Expr]) -> sp.Expr:
    slopes = (
        (sanitised(sp.diff(z, x)), f) for x, f in zip(states, rates, strict=True) if x in z.free_symbols
    )
    return sum((slope * f for slope, f in slopes), sp.S.Zero)


def _at_the_end(
    corners: Sequence[sp.Expr], values: Mapping[sp.Expr, sp.Symbol], speeds: Mapping[sp.Expr, sp.Expr]
) -> dict[sp.Expr, sp.Expr]:
    """Return the value of every corner at the end of a step."""
    now = {value: corner for corner, value in values.items()}
    without = {values[c]: sp.S.Zero for c in corners}
    given: dict[sp.Symbol, sp.Expr] = {STEP_LENGTH: STEP_LENGTH}
    steps: list[Step] = []
    found: dict[sp.Expr, sp.Symbol] = {}
    z = [_name("z", i) for i in range(len(corners))]
    for i, c in enumerate(corners):
        given |= {z[i]: c.args[0], _name("s", i): speeds[c].xreplace(without).xreplace(now)}
        yields = [-sanitised(sp.diff(speeds[c], values[d])).xreplace(now) for d in corners]
        given |= {_name("k", i, j): value for j, value in enumerate(yields)}
    for i in range(len(corners)):
        steps.append((_name("wide", i), maximum(STEP_LENGTH * _name("k", i, i), sp.S.One)))
    for i, c in enumerate(corners):
        # of corners that follow the value at rest, where z stays
        now_there = [found.get(d, _corner(z[j], z[j], _name("wide", j))) for j, d in enumerate(corners)]
        others = (_name("k", i, j) * now_there[j] for j in range(len(corners)) if j != i)
        free, wide, right = _name("s", i) - sum(others, sp.S.Zero), _name("wide", i), _name("right", i)
        # the part of the step over which the corner is implicit: none where the step resolves it
        steps.append((right, z[i] + STEP_LENGTH * (1 - 1 / wide) * free))
        steps += _solved(right, wide, i)
        found[c] = steps[-1][0]
    return {c: evaluated.at(Procedure(given, steps, value), given) for c, value in found.items()}


def _solved(right: sp.Symbol, wide: sp.Symbol, i: int) -> list[Step]:
    """Return the steps to the tanh of the solution of end + (wide - 1)*tanh(end) = right."""
    below, slope, value = _name("below", i), _name("slope", i), _name("value", i)
    # one step of Newton's method from below, which cannot overshoot as tanh bends down
    start = sgn(right) * maximum(absolute(right) / wide, absolute(right) - (wide - 1))
    end = below - (below + (wide - 1) * slope - right) / (1 + (wide - 1) * (1 - slope**2))
    return [(below, start), (slope, sp.tanh(below)), (value, _corner(end, right / wide, wide))]


def _corner(end: sp.Expr, straight: sp.Expr, wide: sp.Symbol) -> sp.Expr:
    """Return the tanh of the end, that goes over into a cut straight line as the corner is sharper."""
    cut = maximum(minimum(straight, sp.S.One), sp.S.NegativeOne)
    share = maximum(1 - SHARP / wide, sp.S.Zero)
    return (1 - share) * sp.tanh(end) + share * cut


def _name(what: str, *numbers: int) -> sp.Symbol:
    return sp.Symbol("_".join(["", what, *map(str, numbers)]), real=True)
