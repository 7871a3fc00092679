"""Changes to a system: another expression in place of a symbol, a longer law or output, more states."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import sympy as sp

from unmodelled.effects.naming import renamed
from unmodelled.systems.model import Event, Port, State, System, symbol

Signals = Mapping[str, tuple[sp.Expr, str]]


def substituted(system: System, name: str, signals: Signals) -> System:
    """The last of the new `signals` (name -> expression and text) in place of the symbol `name` everywhere.

    The new signals stand before all that depend on the symbol, and may use the others.
    """
    old = symbol(name)
    *_, last = signals
    new = {old: signals[last][0]}

    def changed(expression: sp.Expr) -> sp.Expr:
        return expression.xreplace(new)

    before = {n: e for n, e in system.signals.items() if old not in e.free_symbols}
    after = {n: changed(e) for n, e in system.signals.items() if n not in before}
    text = {place: renamed(written, {name: last}) for place, written in system.text.items()}
    grown = replace(
        system,
        signals={**before, **{n: e for n, (e, _) in signals.items()}, **after},
        outputs=tuple(replace(o, expression=changed(o.expression)) for o in system.outputs),
        ports=tuple(p if p.law is None else replace(p, law=changed(p.law)) for p in system.ports),
        dynamics=tuple(changed(f) for f in system.dynamics),
        events=tuple(_event(e, changed) for e in system.events),
    )
    return replace(grown, text=text | {f"signals.{n}": written for n, (_, written) in signals.items()})


def _event(event: Event, changed: Callable[[sp.Expr], sp.Expr]) -> Event:
    then = None if event.then is None else tuple(changed(f) for f in event.then)
    return replace(event, expression=changed(event.expression), then=then)


def with_law(system: System, port: Port, law: sp.Expr, written: str) -> System:
    """The law of `port` grown by `law`."""
    place = f"ports.{port.name}.law"
    text = dict(system.text)
    if port.law is None:
        text[place] = written
    elif place in text:
        text[place] = f"{text[place]} + {written}"
    grown = replace(port, law=law if port.law is None else port.law + law)
    return replace(system, ports=tuple(grown if p == port else p for p in system.ports), text=text)


def with_output(system: System, name: str, more: sp.Expr, written: str) -> System:
    """The output `name` with its expression grown by `more`."""
    place = f"outputs.{name}.expression"
    text = {**system.text, place: f"{system.text.get(place, name)} + {written}"}
    outputs = (replace(o, expression=o.expression + more) if o.name == name else o for o in system.outputs)
    return replace(system, outputs=tuple(outputs), text=text)


def with_states(system: System, states: Mapping[State, tuple[sp.Expr, str]]) -> System:
    """More states, each with its time derivative as expression and text."""
    rates = tuple(rate for rate, _ in states.values())
    events = (e if e.then is None else replace(e, then=(*e.then, *rates)) for e in system.events)
    return replace(
        system,
        states=(*system.states, *states),
        dynamics=(*system.dynamics, *rates),
        events=tuple(events),
        text={**system.text, **{f"dynamics.{s.name}": text for s, (_, text) in states.items()}},
    )
