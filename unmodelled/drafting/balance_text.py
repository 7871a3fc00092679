"""The text of a drafted system file of balances."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from unmodelled.drafting.balances import Balance, symbols_of
from unmodelled.drafting.lines import identified, numbered, one_line, quoted, system_file
from unmodelled.drafting.names import Role, is_measured
from unmodelled.drafting.units import si_unit
from unmodelled.systems.units import SECOND, describe, parse_unit, power, times

#: Other columns that are named in a comment.
NAMES = 5
#: Temperature of surroundings until somebody tells, K, and how far it may be off.
ROOM, AROUND = 293.15, 30.0
#: Resistance until somebody tells, ohm.
RESISTANCE = 0.1


def balance_text(balances: Sequence[Balance], name: str) -> str:
    """Return the text of a system file with a store per level."""
    items = list(numbered(balances))
    sections = {
        "states": [_state(k, balance) for k, balance in items],
        "inputs": list(dict.fromkeys(line for k, balance in items for line in _inputs(k, balance))),
        "outputs": [_output(k, balance) for k, balance in items],
        "parameters": [
            *(line for k, balance in items for line in _parameters(k, balance)),
            *_surroundings(balances[0]),
        ],
        "ports": [_port(k, balance) for k, balance in items],
        "dynamics": [_dynamics(k, balance, items) for k, balance in items],
    }
    filled = "one store per level, filled by what flows in less what flows out"
    turning = all(balance.kind.turns for balance in balances)
    comments = (
        f"A first model: {'one inertia per speed' if turning else filled}.",
        "It lacks what you know of the machine: coupling, other losses. Add that, answer the",
        "questions, and run simulate again.",
    )
    return system_file(comments, name, sections)


def _effort(balance: Balance) -> str:
    """SI unit of what flows into the store."""
    direct = [supply for supply in balance.supplies if supply.direct]
    if direct:
        return describe(parse_unit(si_unit(direct[0].channel.unit)).dimension)
    turning = parse_unit(si_unit(balance.level.unit)).dimension == parse_unit("rad/s").dimension
    return "N" if balance.kind.effort == "N m" and not turning else balance.kind.effort


def over_unit(above: str, below: str) -> str:
    """Return the unit of a factor from one quantity to another one, as people write it.

    Examples:
        >>> over_unit("N m", "A"), over_unit("W", "1"), over_unit("N", "m^3/s")
        ('N m/A', 'W', 'N/(m^3/s)')
    """
    if below == "1":
        return above
    return f"{above}/({below})" if " " in below or "/" in below else f"{above}/{below}"


def _ratio(above: str, below: str, seconds: int = 0) -> str:
    """A unit over another one, times a number of seconds."""
    found = times(parse_unit(above).dimension, power(parse_unit(below).dimension, Fraction(-1)))
    text = describe(times(found, power(SECOND, Fraction(seconds))))
    return text.replace("N m", "J") if above == "W" else text


def _stored(k: str, balance: Balance) -> str:
    """Symbol of the state: behind a resistance, the level of the store is not what is logged."""
    return f"z{k}" if balance.kind.electric else f"{balance.kind.symbols[0]}{k}"


def _state(k: str, balance: Balance) -> str:
    said = one_line(balance.level.signal.address)
    said = f"voltage of the charge, behind the resistance of {said}" if balance.kind.electric else said
    return f"  {_stored(k, balance)}: {{unit: {si_unit(balance.level.unit)}}}  # {said}"


def _inputs(k: str, balance: Balance) -> list[str]:
    lines = []
    if balance.goal is not None:
        goal, level = one_line(balance.goal.address), balance.kind.symbols[0]
        lines.append(
            f"  # {goal} is the set point of {level}{k}: the loop is closed, a controller sets its supply."
        )
    if not balance.supplies and balance.source is None:
        lines.append(f"  # Question: which column {balance.kind.verb} {_stored(k, balance)}? None was found.")
    fills = balance.kind.verb
    beside = [signal.address for signal in balance.others if signal.role is not None]
    if beside and any(supply.direct for supply in balance.supplies):
        named = one_line(", ".join(beside[:NAMES]))
        lines.append(f"  # Question: does {named} set another flow into or out of {_stored(k, balance)}?")
    inputs = [(symbol, channel) for symbol, channel, is_level in symbols_of(k, balance) if not is_level]
    for j, (symbol, channel) in enumerate(inputs):
        supply = balance.supplies[j] if j < len(balance.supplies) else None
        said = channel.signal.address
        if supply is not None and not supply.direct:
            others = ", ".join(signal.address for signal in balance.others[:NAMES])
            said += f". Question: is this what {fills} {_stored(k, balance)}?" + (
                f" Others: {others}" if others else ""
            )
        elif supply is not None and not supply.certain and not balance.kind.electric:
            said += f". Question: by the values, it lowers {_stored(k, balance)}. Does it?"
        elif supply is not None and balance.kind.supply is Role.CURRENT:
            said += ". By the values, a positive current " + ("discharges" if supply.outward else "charges")
        measured = (
            supply is None or balance.kind.supply is Role.CURRENT or is_measured(channel.signal.address)
        )
        fixed = (", commanded: false" if measured else "") + (", hold: true" if channel.signal.held else "")
        lines.append(f"  {symbol}: {{unit: {quoted(channel.unit)}{fixed}}}  # {one_line(said)}")
    return lines


def _output(k: str, balance: Balance) -> str:
    level, unit = balance.kind.symbols[0], quoted(balance.level.unit)
    if not balance.kind.electric:
        return f"  {level}{k}: {{unit: {unit}}}"
    sign = "-" if balance.supplies and balance.supplies[0].outward else "+"
    shown = f"z{k} {sign} R{k}*i{k}" if balance.supplies else f"z{k}"
    return f"  {level}{k}: {{unit: {unit}, expression: {shown}}}"


def _parameters(k: str, balance: Balance) -> list[str]:
    kind, effort, level = balance.kind, _effort(balance), si_unit(balance.level.unit)
    size = balance.fit.size if balance.fitted else 1.0
    origin = "fitted to the logs" if balance.fitted else "a guess"
    *_, store, loss = kind.symbols
    lines = [f"  # Question: what is the {kind.store} {store}{k}? This one is {origin}."]
    for j, supply in enumerate(balance.supplies, start=1):
        if not supply.direct:
            own, name = si_unit(supply.channel.unit), f"u{k}" + (f"_{j}" if j > 1 else "")
            one = f"{name} = 1" + (
                " (100 %)" if supply.channel.unit == "%" else "" if own == "1" else f" {own}"
            )
            lines.append(f"  # Question: which {effort} does {one} make? {store}{k} goes with it.")
            lines.append(f"  k_{name}: {{value: 1, unit: {quoted(over_unit(effort, own))}, guess: true}}")
    lines.append(f"  {store}{k}: {identified(size, _ratio(effort, level, 1))}")
    if balance.source is not None:
        guess = balance.exchange or size / balance.seconds
        lines.append(f"  # Question: does {_stored(k, balance)} exchange with another store in this way?")
        lines.append(f"  g{k}: {identified(guess, _ratio(effort, level))}")
    if kind.electric:
        drop = balance.fit.loss or RESISTANCE
        resistance = f"  R{k}: {identified(drop, 'ohm', (0.0, 10.0 * drop))}"
        return [*lines, resistance] if balance.supplies else lines
    if kind.loses:
        high = 10.0 * max(balance.fit.loss, size / balance.seconds)
        lines.append(f"  {loss}{k}: {identified(balance.fit.loss, _ratio(effort, level), (0.0, high))}")
    return lines


def _surroundings(balance: Balance) -> list[str]:
    """The temperature of surroundings that are not logged."""
    kind, outside = balance.kind, balance.fit.outside
    if not kind.around or balance.around is not None:
        return []
    known = bool(abs(outside - ROOM) < AROUND)
    value, asked = (outside, "by the logs") if known else (ROOM, "a guess")
    bounds = f"identify: true, bounds: [{value - AROUND:.5g}, {value + AROUND:.5g}]"
    return [
        f"  # Question: how warm are the surroundings? This is {asked}.",
        f"  {kind.symbols[0]}_a: {{value: {value:.5g}, unit: {si_unit(balance.level.unit)}, {bounds}}}",
    ]


def _port(k: str, balance: Balance) -> str:
    place = "velocity" if balance.kind.turns else "position"
    effort = _left(k, balance)
    unit, here = _effort(balance), _stored(k, balance)
    return f"  {balance.kind.port}{k}: {{effort: {effort}, unit: {unit}, {place}: {here}}}"


def _left(k: str, balance: Balance) -> str:
    """Symbol of the effort that a diagnosis looks for."""
    return f"tau{k}" if balance.kind.turns else f"x{k}"


def _exchanges(k: str, balance: Balance, items: Sequence[tuple[str, Balance]]) -> list[str]:
    """Terms of the exchange with other stores."""
    here, terms = _stored(k, balance), []
    for j, other in items:
        if balance.source == other.level.signal.address:
            terms.append(f"+ g{k}*({_stored(j, other)} - {here})")
        if other.source == balance.level.signal.address:
            terms.append(f"- g{j}*({here} - {_stored(j, other)})")
    return terms


def _dynamics(k: str, balance: Balance, items: Sequence[tuple[str, Balance]]) -> str:
    level, _, store, loss = balance.kind.symbols
    here = _stored(k, balance)
    terms = []
    inputs = [symbol for symbol, _, is_level in symbols_of(k, balance) if not is_level]
    for symbol, supply in zip(inputs, balance.supplies, strict=False):
        factor = "" if supply.direct else f"k_{symbol}*"
        terms.append(("- " if supply.outward else "+ ") + factor + symbol)
    terms += _exchanges(k, balance, items)
    if balance.kind.loses and not balance.kind.electric:
        terms.append(f"- {loss}{k}*({here} - {level}_a)" if balance.kind.around else f"- {loss}{k}*{here}")
    terms.append(f"- {_left(k, balance)}")
    text = " ".join(terms).removeprefix("+ ")
    text = f"-{text[2:]}" if text.startswith("- ") else text
    return f"  {here}: ({text})/{store}{k}"
