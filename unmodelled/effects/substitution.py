"""Changes of a system: replacement of a symbol, extension of a law or output, additional states."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import sympy as sp

from unmodelled.effects.naming import renamed
from unmodelled.systems.model import Event, Port, State, System, symbol

Signals = Mapping[str, tuple[sp.Expr, str]]


def substituted(system: System, name: str, signals: Signals) -> System:
    """Return the system in which a new signal replaces a symbol everywhere."""
    old = symbol(name)
    *_, last = signals
    before = {n: e for n, e in system.signals.items() if old not in e.free_symbols}
    changed = _replaced(system, {old: signals[last][0]}, {name: last})
    after = {n: e for n, e in changed.signals.items() if n not in before}
    grown = replace(changed, signals={**before, **{n: e for n, (e, _) in signals.items()}, **after})
    return replace(
        grown, text={**grown.text, **{f"signals.{n}": written for n, (_, written) in signals.items()}}
    )


def with_right_number(system: System, name: str, error: str) -> System:
    """Return the system in which a parameter has its right value instead of a signal, value plus error."""
    signal = next(n for n, e in system.signals.items() if e == symbol(name) + symbol(error))
    values = dict(zip((p.name for p in system.parameters), system.values, strict=True))
    found = _replaced(system, {symbol(error): sp.S.Zero}, {signal: name})
    return replace(
        found,
        signals={n: e for n, e in found.signals.items() if n != signal},
        parameters=tuple(
            replace(p, value=values[name] + values[error]) if p.name == name else p
            for p in found.parameters
            if p.name != error
        ),
        text={place: written for place, written in found.text.items() if place != f"signals.{signal}"},
    )


def _replaced(system: System, new: Mapping[sp.Expr, sp.Expr], words: Mapping[str, str]) -> System:
    """The system with other expressions for symbols, and other words in its texts."""

    def changed(expression: sp.Expr) -> sp.Expr:
        return expression.xreplace(new)

    return replace(
        system,
        states=tuple(replace(s, initial=changed(s.initial)) for s in system.states),
        signals={n: changed(e) for n, e in system.signals.items()},
        outputs=tuple(replace(o, expression=changed(o.expression)) for o in system.outputs),
        ports=tuple(p if p.law is None else replace(p, law=changed(p.law)) for p in system.ports),
        dynamics=tuple(changed(f) for f in system.dynamics),
        events=tuple(_event(e, changed) for e in system.events),
        text={place: renamed(written, words) for place, written in system.text.items()},
    )


def _event(event: Event, changed: Callable[[sp.Expr], sp.Expr]) -> Event:
    then = None if event.then is None else tuple(changed(f) for f in event.then)
    return replace(event, expression=changed(event.expression), then=then)


def with_law(system: System, port: Port, law: sp.Expr, written: str) -> System:
    """Return the system with a term added to the known law of a port."""
    place = f"ports.{port.name}.law"
    text = dict(system.text)
    if port.law is None:
        text[place] = written
    elif place in text:
        text[place] = f"{text[place]} + {written}"
    grown = replace(port, law=law if port.law is None else port.law + law)
    return replace(system, ports=tuple(grown if p == port else p for p in system.ports), text=text)


def with_output(system: System, name: str, more: sp.Expr, written: str) -> System:
    """Return the system with a term added to an output."""
    place = f"outputs.{name}.expression"
    text = {**system.text, place: f"{system.text.get(place, name)} + {written}"}
    outputs = (replace(o, expression=o.expression + more) if o.name == name else o for o in system.outputs)
    return replace(system, outputs=tuple(outputs), text=text)


def with_states(
    system: System, states: Mapping[State, tuple[sp.Expr, str]], starts: Mapping[str, str]
) -> System:
    """Return the system with additional states."""
    rates = tuple(rate for rate, _ in states.values())
    events = (e if e.then is None else replace(e, then=(*e.then, *rates)) for e in system.events)
    return replace(
        system,
        states=(*system.states, *states),
        dynamics=(*system.dynamics, *rates),
        events=tuple(events),
        text={
            **system.text,
            **{f"dynamics.{s.name}": text for s, (_, text) in states.items()},
            **{f"states.{name}.initial": text for name, text in starts.items()},
        },
    )
