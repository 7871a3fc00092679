"""How the logs were made, from the parts of the measurement chain that pay: a sentence and an entry each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from unmodelled.base.kind_words import kind_name
from unmodelled.base.wording import amounts, law_name, place_name
from unmodelled.diagnosis.data.result import ChainPart
from unmodelled.effects.added import Added
from unmodelled.effects.library import kind_of
from unmodelled.systems.model import Input, Output
from unmodelled.systems.units import parse_unit

#: What a part of the chain does, by the structure of its law.
Role = Literal["spread", "delay", "lag", "gain", "zero", "other"]
#: Units of ratios, which are said in percent.
RATIOS = ("", "1", "-")
#: Share of a delay that all channels have, within which they have it alike: no window ends at one instant.
ROUNDING = 0.05
#: Words for parameters that lose power, by a unit of their dimension.
LOSSES = {"N s/m": "damping", "N m s/rad": "damping", "W/K": "heat loss", "ohm": "resistance"}
LOSSES |= {"s": "time constant"}


def chain_entry(part: ChainPart) -> dict[str, Any]:
    """Return a part of the measurement chain as diagnosis.json has it: in SI, and as a person says it."""
    added, (value, error, unit) = part.added, _shown(part)
    entry: dict[str, Any] = {"channel": added.place.channel, "family": added.family}
    entry |= {"variant": added.variant} if added.variant else {}
    entry |= {"value": part.value, "unit": part.unit, "error": part.error}
    entry |= {"per_experiment": part.per_experiment, "sentence": chain_sentence(part)}
    if unit != part.unit:
        entry["shown"] = {"value": value, "unit": unit, "error": error}
    return entry


def chain_sentence(part: ChainPart) -> str:
    """Return how a part of the measurement chain changes what is logged, in the unit of the column."""
    added, (value, _, unit) = part.added, _shown(part)
    name, more, (size,) = added.place.name, value >= 0.0, amounts([abs(value)], unit)
    match _role(part), added.place.kind:
        case "spread", _:
            return f"{_varying(added)} varies by {size} from run to run"
        case "delay", "actuator":
            return f"{name} acts {size} {'late' if more else 'early'}"
        case "delay", _:
            return f"{name} is {size} {'late' if more else 'early'}"
        case "lag", "actuator":
            return f"{name} acts behind a lag of {size}"
        case "lag", _:
            return f"{name} is shown behind a lag of {size}"
        case "gain", "actuator":
            return f"{name} acts {size} {'stronger' if more else 'weaker'} than logged"
        case "gain", _:
            return f"{name} reads {size} too {'much' if more else 'little'}"
        case "zero", "actuator":
            return f"{name} acts {size} {'higher' if more else 'lower'} than logged"
        case "zero", _:
            return f"the zero of {name} is {size} too {'high' if more else 'low'}"
    return f"{_law(added)} is {size if more else f'−{size}'}"


def without_common_delay(parts: Sequence[ChainPart]) -> tuple[ChainPart, ...]:
    """Return the parts without the delay of all outputs that the inputs, which act early, take back.

    Logs do not show at which time all of it happened. What is left of a delay is told where it is larger than
    its standard error, and than a share of what all have.
    """
    late = {(p.added.place.kind, p.added.place.name): p for p in parts if _role(p) == "delay"}
    if not late:
        return tuple(parts)
    system = next(iter(late.values())).added.system
    signs = {("actuator", i.name): -1.0 for i in system.inputs}
    signs |= {("sensor", o.name): 1.0 for o in system.outputs}
    sizes = [sign * late[key].value if key in late else 0.0 for key, sign in signs.items()]
    if not system.inputs or not (min(sizes) > 0.0 or max(sizes) < 0.0):
        return tuple(parts)
    common = min(sizes, key=abs)
    found = list[ChainPart]()
    for part in parts:
        moved = part
        if _role(part) == "delay":
            sign = signs[part.added.place.kind, part.added.place.name]
            moved = replace(part, value=part.value - sign * common)
        if moved is part or abs(moved.value) > max(np.nan_to_num(part.error), ROUNDING * abs(common)):
            found.append(moved)
    return tuple(found)


def chain_explains(share: float) -> str:
    """Return a note that the measurement chain explains most of the squared gap, a share of it."""
    return (
        f"how these logs were made explains {100.0 * share:.0f} % of the squared gap: a delay, lag or gain "
        "that belongs to the machine and not to its logger is missing in the system file"
    )


def small_gap(output: str, share: float, added: Added, removed: float) -> str:
    """Return a note on a gap that is too small to name the law that would explain it.

    The gap of the output is the `share` of the error of a prediction without a model; the law would remove
    the share `removed` of the squared gap.
    """
    law, (size,), (part,) = _kind(added), amounts([100.0 * share], "%"), amounts([100.0 * removed], "%")
    return (
        f"the gap of {output} is {size} of the motion; {law} would remove {part} of its square: "
        f"if errors of this size matter, log motions in which {law} shows more"
    )


def _kind(added: Added) -> str:
    """Kind and place in words."""
    place = added.place
    where = {"parameter": place.name} if place.kind == "parameter" else {}
    return kind_name({"kind": kind_of(added), "port": place.channel, **where})


def _role(part: ChainPart) -> Role:
    added = part.added
    if part.per_experiment:
        return "spread"
    if added.delays:
        return "delay"
    if added.memory:
        return "lag"
    if len(added.regressors) != 1 or added.place.kind not in ("actuator", "sensor"):
        return "other"
    return "zero" if added.regressors[0].is_number else "gain"


def _shown(part: ChainPart) -> tuple[float, float, str]:
    """Value, standard error and unit as a person says them."""
    added, role = part.added, _role(part)
    if role in ("spread", "gain") and part.unit in RATIOS:
        return 100.0 * part.value, 100.0 * part.error, "%"
    if role == "zero":
        system, is_input = added.system, added.place.kind == "actuator"
        items: tuple[Input | Output, ...] = system.inputs if is_input else system.outputs
        column = next(item for item in items if item.name == added.place.name).as_difference
        return part.value / column.factor, part.error / column.factor, column.text
    return part.value, part.error, part.unit


def _varying(added: Added) -> str:
    """What differs between experiments."""
    name = added.place.name
    match added.place.kind:
        case "actuator":
            return f"the supply (gain of {name})"
        case "parameter":
            (unit,) = (p.unit for p in added.system.parameters if p.name == name)
            return f"the {_quantity(unit)} {name}"
    return f"the {_law(added)}"


def _quantity(unit: str) -> str:
    own = parse_unit(unit).dimension
    alike: Mapping[object, str] = {parse_unit(known).dimension: words for known, words in LOSSES.items()}
    return alike.get(own, "parameter")


def _law(added: Added) -> str:
    return f"{law_name(added.family, added.variant)} at {place_name(added.place.channel)}"
