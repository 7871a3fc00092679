"""Terms of the known physics that act like the effort of a port: an input, and a spring between bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
import sympy as sp

from unmodelled.systems.model import Input, Port, System, symbol
from unmodelled.systems.numeric import numpy_system_function

Rates = tuple[sp.Expr, ...]
Symbols = tuple[sp.Symbol, ...]

#: Random points at which two influences are compared, and the rounding error of the square of their cosine.
_POINTS, _ALIKE = 32, 1e-9


def driven_port(system: System, item: Input) -> tuple[Port, int] | None:
    """Return the port that an input drives, and the sign of the drive against the port's effort.

    An input drives a port if it acts on all rates in proportion to the effort of the port: the torque at a
    joint or the current of a motor does, the voltage of a motor whose current is a state does not. A set
    point of the port's position is no drive.
    """
    states = {state.name: state.unit for state in system.states}
    pairs = {
        port: _Pair(system.closed, symbol(item.name), symbol(port.effort), system)
        for port in system.ports
        if not (
            port.velocity is None or port.domain != "power" or states.get(str(port.position)) == item.unit
        )
        and not system.expression(port.velocity).has(*system.u)
    }
    # where the two meet is told without derivatives of the rates, which are long for a robot
    met = {port: replace(pair, rates=(node,)) for port, pair in pairs.items() if (node := pair.meeting)}
    signs = ((port, _sign(pair)) for port, pair in (met or pairs).items())
    return next((found for found in signs if found[1]), None)


def stiffness(system: System, port: Port) -> sp.Expr | None:
    """Return the stiffness of a spring of the known physics that acts where the effort of a port acts.

    Only for an effort on at least two bodies: what holds a single body at a position may be a servo as well.
    """
    if port.position is None or port.domain != "power":
        return None
    return _stiffness(
        system.closed, system.expression(port.position), symbol(port.effort), system.p, system.c
    )


@dataclass(frozen=True)
class _Pair:
    """Input and effort whose influence on the rates is compared."""

    rates: Rates
    item: sp.Symbol
    effort: sp.Symbol
    system: System = field(compare=False)

    @property
    def meeting(self) -> sp.Expr | None:
        """The only sum with the effort, if rates depend on effort and input through it alone; else None."""
        own = {self.effort, -self.effort}
        sums = {node for rate in self.rates for node in rate.atoms(sp.Add) if not own.isdisjoint(node.args)}
        if len(sums) != 1:
            return None
        (node,) = sums
        rest = (rate.xreplace({node: sp.Dummy(real=True)}) for rate in self.rates)
        return node if node.has(self.item) and not any(e.has(self.item, self.effort) for e in rest) else None


@lru_cache(maxsize=256)
def _sign(pair: _Pair) -> int:
    """1 if the input moves the system against the effort everywhere, -1 if with it, 0 if neither."""
    system, rng = pair.system, np.random.default_rng(0)
    moved = [rate for rate in pair.rates if rate.has(pair.item, pair.effort)]
    slopes = [sp.diff(rate, one) for one in (pair.item, pair.effort) for rate in moved]
    x, u = (rng.uniform(-1.0, 1.0, (_POINTS, len(each))) for each in (system.x, system.u))
    c = rng.uniform(0.5, 1.5, (_POINTS, len(system.c)))
    function = numpy_system_function(system, slopes, efforts_zero=True)
    a, b = function(0.0, x, u, np.empty(0), np.array(system.values), c).T.reshape(2, len(moved), _POINTS)
    known = np.isfinite(a).all(0) & np.isfinite(b).all(0)
    product, sizes = ((one * b).sum(0)[known] for one in (a, b))
    both = sizes * (a**2).sum(0)[known]
    if not product.any() or (product**2 < (1.0 - _ALIKE) * both).any():
        return 0
    return 1 if (product <= 0.0).all() else -1 if (product >= 0.0).all() else 0


@lru_cache(maxsize=256)
def _stiffness(
    rates: Rates, position: sp.Expr, effort: sp.Symbol, parameters: Symbols, others: Symbols
) -> sp.Expr | None:
    moved = [rate for rate in rates if rate.has(effort)]
    if len(moved) < 2:
        return None
    constants = {*parameters, *others}
    along = [x for x in position.free_symbols if x not in constants]
    points = _rational_points((*parameters, *others))
    # what else holds one of the bodies is in the rate of this body only
    every = []
    for rate in moved:
        pushed = sp.diff(rate, effort)
        slopes = {x: pushed * sp.diff(position, x) for x in along}
        quotients = (sp.diff(rate, x) / slope for x, slope in slopes.items() if slope != 0)
        found = (k for k in quotients if k.free_symbols <= constants)
        every.append({tuple(k.xreplace(point) for point in points): k for k in found})
    common = [_reduced(every[0][values], points) for values in set.intersection(*map(set, every))]
    common = [k for k in common if k and k.free_symbols <= {*parameters}]
    return common[0] if len(common) == 1 else None


def _rational_points(constants: Symbols) -> tuple[dict[sp.Symbol, sp.Rational], ...]:
    """Two points at which different rational functions of the constants have different values."""
    return tuple(
        {s: sp.Rational(sp.prime(first + k), sp.prime(1 + k)) for k, s in enumerate(constants)}
        for first in (len(constants) + 2, 2 * len(constants) + 2)
    )


def _reduced(quotient: sp.Expr, points: Sequence[Mapping[sp.Symbol, sp.Rational]]) -> sp.Expr:
    """A quotient as a function of those symbols alone on which its value depends.

    Cancelling nested fractions of ten symbols takes minutes.
    """
    here, there = points
    value = quotient.xreplace(here)
    gone = {s: here[s] for s in quotient.free_symbols if quotient.xreplace({**here, s: there[s]}) == value}
    return sp.cancel(quotient.xreplace(gone))
