"""A system as a cascade: states that the input alone drives, states of a sample, states of an experiment.

For the clutch of appendix 3.8 pressure and piston follow the current alone, whatever the sample and the motor
speed; the pressure on the plates and the drag of the oil film are the same for every motor speed and brake.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from unmodelled.engine.cascade.hoisting import PLACES, RUN, SAMPLED, SCALAR, SHARED, Changes, Hoisting
from unmodelled.systems.functions import sanitised
from unmodelled.systems.model import TIME, Event, System, symbol

Named = tuple[tuple[sp.Symbol, sp.Expr], ...]

#: What the parts of a place may be computed from.
_LOWER = {SHARED: (SCALAR, SAMPLED), RUN: (SCALAR, SAMPLED), SAMPLED: (SCALAR,), SCALAR: ()}


@dataclass(frozen=True)
class Cascade:
    """Equations that lead to one event, without efforts, cut by what they change with.

    States that do not lead to the event are in no group.

    Attributes:
        driven: indices of the states that the input alone drives.
        shared: indices of the states that depend on the uncertain parameters too, but not on the operating
            point.
        own: indices of the other states.
        uncertain: symbols of the uncertain parameters.
        clock: symbols of time, inputs and driven states, as far as used.
        parts: symbols and expressions by place, in terms of places that change less (and SHARED: of `clock`
            and the shared states).
        driven_rates: time derivatives of the driven states.
        shared_rates: time derivatives of the shared states.
        rates: time derivatives of the own states.
        event: expression that falls through zero.
    """

    driven: tuple[int, ...]
    shared: tuple[int, ...]
    own: tuple[int, ...]
    uncertain: tuple[sp.Symbol, ...]
    clock: tuple[sp.Symbol, ...]
    parts: Mapping[Changes, Named]
    driven_rates: tuple[sp.Expr, ...]
    shared_rates: tuple[sp.Expr, ...]
    rates: tuple[sp.Expr, ...]
    event: sp.Expr

    @classmethod
    def of(cls, system: System, event: Event, uncertain: Sequence[str]) -> Cascade:
        """Return the cascade that leads to an event.

        Args:
            system: system with the event.
            event: event whose time is wanted.
            uncertain: names of the uncertain parameters.
        """
        closed, crossing = equations(system, event)
        follows = dependence(system, closed, crossing, uncertain)
        driven = tuple(k for k, changes in follows.items() if changes == Changes.TIME)
        shared = tuple(k for k, changes in follows.items() if changes == SHARED)
        own = tuple(k for k, changes in follows.items() if changes not in SHARED)
        clock = (TIME, *system.u, *(system.x[k] for k in driven))
        constant = dict.fromkeys(system.p, Changes.NOTHING) | _direct(system, uncertain)
        moving = dict.fromkeys(clock, Changes.TIME) | dict.fromkeys((system.x[k] for k in shared), SHARED)
        outer = Hoisting(constant | moving)
        *rates, falling = (outer(e) for e in (*(closed[k] for k in own), crossing))
        # shared values are themselves computed at every moment, from clock and shared states
        inner = outer.without(moving)
        shared_rates = tuple(inner(closed[k], _LOWER[SHARED]) for k in shared)
        parts = {
            place: tuple((name, inner(e, _LOWER[place])) for e, name in list(inner.found[place].items()))
            for place in reversed(PLACES)
        }
        seen = {s for e in (*shared_rates, *(e for _, e in parts[SHARED])) for s in e.free_symbols}
        return cls(
            driven,
            shared,
            own,
            tuple(symbol(name) for name in uncertain),
            tuple(s for s in clock if s in seen),
            parts,
            tuple(closed[k] for k in driven),
            shared_rates,
            tuple(rates),
            falling,
        )


def common_states(system: System, event: Event, uncertain: Sequence[str]) -> tuple[int, ...]:
    """Return the indices of the states that follow the input, whatever the operating point.

    Args:
        system: system with the event.
        event: event whose time is wanted.
        uncertain: names of the uncertain parameters.
    """
    follows = dependence(system, *equations(system, event), uncertain)
    return tuple(k for k, changes in follows.items() if changes in SHARED)


def equations(system: System, event: Event) -> tuple[tuple[sp.Expr, ...], sp.Expr]:
    """Return time derivatives of the states and the event's expression, every unknown effort zero.

    Args:
        system: system with the event.
        event: event whose time is wanted.
    """
    none = dict.fromkeys(system.e, sp.S.Zero)
    return tuple(f.xreplace(none) for f in system.closed), sanitised(event.expression)


def dependence(
    system: System, closed: Sequence[sp.Expr], event: sp.Expr, uncertain: Sequence[str]
) -> dict[int, Changes]:
    """Find what every state that leads to an event changes with besides its own start.

    Args:
        system: system of the states.
        closed: time derivatives of all states.
        event: expression of the event.
        uncertain: names of the uncertain parameters.

    Returns:
        Dependence by index of the state.
    """
    index = {s: k for k, s in enumerate(system.x)}
    needed = {index[s] for s in event.free_symbols & set(system.x)}
    before = None
    while before != needed:
        before = set(needed)
        needed |= {index[s] for k in before for s in closed[k].free_symbols & set(system.x)}
    direct = _direct(system, uncertain)
    found = dict.fromkeys(sorted(needed), Changes.TIME)
    last = None
    while last != found:
        last = dict(found)
        for k in found:
            for s in closed[k].free_symbols:
                found[k] |= direct.get(s, Changes.NOTHING) | last.get(index.get(s, -1), Changes.NOTHING)
    return found


def _direct(system: System, uncertain: Sequence[str]) -> dict[sp.Symbol, Changes]:
    """What makes a difference between operating points and between samples."""
    samples = dict.fromkeys((symbol(name) for name in uncertain), Changes.SAMPLE)
    return dict.fromkeys(system.c, Changes.POINT) | samples
