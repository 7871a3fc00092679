"""Match outputs with the states that they show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from unmodelled.systems.model import TIME, System
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.units import parse_unit

#: Largest slope of a sensor's curve, relative to its gain, with which a step of Newton's method reads it.
LARGEST_SLOPE = 0.5
#: Random states at which the slope is tried, and how far from zero they are: a curve that bends ever more,
#: such as a square, is not slight.
_POINTS, _FAR = 64, 1e4


@dataclass(frozen=True)
class Reading:
    """State that an output shows as gain * (state + beside) + offset, or the derivative of such a state.

    An output that shows a low-pass filtered quantity y_f shows the quantity as y_f + lag * d(y_f)/dt.
    """

    state: int  # index
    output: int  # index
    gain: sp.Expr  # in terms of parameters and constants of the operating point
    offset: sp.Expr  # in the same terms and inputs
    slope: bool = False  # the state is the time derivative of what the output shows
    lag: sp.Expr = sp.S.Zero  # time constant of a low-pass filter, in terms of parameters; 0: none
    #: In terms of parameters, constants and states, also the state itself if the sensor is slightly curved;
    #: a shown one stands for (output - offset)/gain.
    beside: sp.Expr = sp.S.Zero

    @property
    def plain(self) -> bool:
        """Whether the output, or its derivative, is the state itself, or this state and others."""
        return bool(self.gain == 1 and self.offset == 0 and self.lag == 0)


def readings(system: System, usable: Callable[[Reading], bool] = lambda _: True) -> tuple[Reading, ...]:
    """Return all states that outputs show, in the order of the states.

    An output that is a state goes before one that is a function of it, and one of few states before one of
    many. An output of several states shows the one that is neither known from other outputs nor from the
    inputs alone.
    """
    found: dict[int, Reading] = {}
    forgetful, known = _forgetful(system), set[sp.Symbol]()
    shown = [output.expression for output in system.outputs]
    own = [(e not in system.x, len(e.free_symbols & set(system.x))) for e in shown]
    order = sorted(range(len(shown)), key=lambda j: own[j])
    while True:
        for j in order:
            reading = _reading(system, j, known, found)
            if reading is None or reading.state in found or not usable(reading):
                continue
            slope = _slope(system, reading, found)
            if reading.beside == 0 or slope is not None or system.dynamics[reading.state] not in system.x:
                found[reading.state] = reading
        for reading in list(found.values()):
            if (slope := _slope(system, reading, found)) is not None:
                found.setdefault(slope.state, slope)
        now = {system.x[k] for k in found} | forgetful
        if now == known:
            return tuple(found[k] for k in sorted(found))
        known = now


def without_beside(system: System, found: Sequence[Reading]) -> dict[sp.Symbol, sp.Expr]:
    """Return the states that outputs show together with others, in terms of what they show and the others."""
    return {system.x[r.state]: system.x[r.state] - r.beside for r in found if r.beside != 0}


def hidden_states(system: System, found: Sequence[Reading]) -> list[int]:
    """Return the indices of the states that no output shows."""
    shown = {reading.state for reading in found}
    return [k for k in range(len(system.states)) if k not in shown]


def _reading(system: System, j: int, known: set[sp.Symbol], found: Mapping[int, Reading]) -> Reading | None:
    output = system.outputs[j]
    expression, lag = _unfiltered(system, output.expression)
    seen = expression.free_symbols & set(system.x)
    unknown = seen - known
    # a speed in proportion to a function of the angle is read as soon as the angle is
    at_once = len(unknown) > 1
    unknown -= {system.x[m] for m in found} if at_once else set()
    if len(unknown) != 1 or not expression.free_symbols <= {*seen, *system.u, *system.p, *system.c}:
        return None
    (state,) = unknown
    k, others = system.x.index(state), seen - unknown
    gain, rest, curved = _parts(expression, state, {*seen, *system.u})
    if not _is_slight(system, curved, state, gain) or (at_once and curved == 0):
        return None
    offset, beside = rest.as_independent(*others, as_Add=True) if others else (rest, sp.S.Zero)
    if lag != 0 and (others or curved != 0 or offset.free_symbols & set(system.u)):
        return None
    beside = _solved(beside, curved, state, gain)
    if not others:
        return Reading(k, j, gain, offset, lag=lag, beside=beside / gain)
    # a speed that is read from an acceleration would have its noise over a damping
    measured = others & {system.x[m] for m in found}
    if beside.free_symbols & set(system.u) or (
        measured and parse_unit(output.unit) != parse_unit(system.states[k].unit)
    ):
        return None
    shown = beside.xreplace(without_beside(system, list(found.values())))
    return Reading(k, j, gain, offset, beside=shown / gain)


def _parts(expression: sp.Expr, state: sp.Symbol, moving: set[sp.Symbol]) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return the constant gain of a state in a sum, the terms without it, and those in which it bends."""
    terms = sp.Add.make_args(sp.expand(expression))
    slopes = {term: term.coeff(state) for term in terms if term.has(state)}
    straight = [t for t, k in slopes.items() if not k.free_symbols & moving and sp.expand(t - k * state) == 0]
    rest = [term for term in terms if term not in slopes]
    curved = [term for term in slopes if term not in straight]
    return sp.Add(*(slopes[term] for term in straight)), sp.Add(*rest), sp.Add(*curved)


def _is_slight(system: System, curved: sp.Expr, state: sp.Symbol, gain: sp.Expr) -> bool:
    """Return whether a sensor can be read: its curve has a small slope against the gain everywhere."""
    waves = all(type(part) in (sp.sin, sp.cos) for part in curved.atoms(sp.Function))
    if gain == 0 or not waves or curved.free_symbols & set(system.u):
        return False
    if curved == 0:
        return True
    x = np.random.default_rng(0).uniform(-_FAR, _FAR, (_POINTS, len(system.states)))
    u, c = np.zeros((_POINTS, len(system.u))), np.ones((_POINTS, len(system.c)))
    function = numpy_system_function(system, [sp.diff(curved, state) / gain], efforts_zero=True)
    slope = function(0.0, x, u, np.empty(0), np.array(system.values), c)
    return bool(np.all(np.abs(slope) <= LARGEST_SLOPE))


def _solved(beside: sp.Expr, curved: sp.Expr, state: sp.Symbol, gain: sp.Expr) -> sp.Expr:
    """Return beside + curved(x) in terms of what is shown, x + (beside + curved(x)) / gain: a Newton step.

    It is exact for a gain that depends on other states.
    """
    return (beside + curved) / (1 + sp.diff(curved, state) / gain)


def _slope(system: System, shown: Reading, found: Mapping[int, Reading]) -> Reading | None:
    """Return the reading of the state that is the derivative of a state that an output shows."""
    rate = system.dynamics[shown.state]
    if shown.slope or rate not in system.x or shown.offset.free_symbols & set(system.u):
        return None
    alone = {system.x[k]: system.dynamics[k] for k, r in found.items() if r.beside == 0}
    alone |= {system.x[shown.state]: rate}
    others = shown.beside.free_symbols & set(system.x)
    if not others <= set(alone) or not {alone[x] for x in others} <= {*alone, rate}:
        return None
    beside = sp.Add(*(sp.diff(shown.beside, x) * alone[x] for x in others))
    return Reading(system.x.index(rate), shown.output, shown.gain, sp.S.Zero, True, shown.lag, beside)


def _forgetful(system: System) -> set[sp.Symbol]:
    """Return the states that inputs alone drive and that forget their start, as an RC branch does."""
    rates = dict(zip(system.x, system.dynamics, strict=True))
    others = {*system.u, *system.p, *system.c, TIME}

    def alone(states: set[sp.Symbol]) -> set[sp.Symbol]:
        fewer = {x for x in states if rates[x].free_symbols <= states | others}
        return states if fewer == states else alone(fewer)

    # derivatives of the rates of an arm take long: most states are ruled out without
    driven = alone({x for x, rate in rates.items() if rate.has(x)})
    return alone({x for x in driven if sp.diff(rates[x], x) != 0})


def _unfiltered(system: System, expression: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return the expression of an output without a low-pass filter, and the time constant of the filter.

    A filtered output is gain * (y + c*(z - y)) + offset. The state z has the derivative (y - z)/T, and c is 1
    with the filter and 0 without it, so that the time constant is c*T. The quantity y shows one other state.
    """
    seen = expression.free_symbols & set(system.x)
    for z in seen if len(seen) == 2 else ():
        (x,) = seen - {z}
        rate = system.dynamics[system.x.index(z)]
        pole, weight = sp.diff(rate, z), sp.diff(expression, z)
        if pole == 0 or not (pole.free_symbols | weight.free_symbols) <= {*system.p, *system.c}:
            continue
        y = sp.expand(z - rate / pole)
        whole = sp.expand(expression.xreplace({z: y}))
        inner, gain = sp.diff(y, x), sp.diff(whole, x)
        if z not in whole.free_symbols and inner != 0 and gain != 0:
            return whole, sp.cancel(-weight * inner / (gain * pole))
    return expression, sp.S.Zero
