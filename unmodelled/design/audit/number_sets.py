"""Sets of numbers of a system: mappings, files of numbers, and system files of the same structure."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from unmodelled.base.errors import BadInput, Faults, closest
from unmodelled.diagnosis.data.robot_numbers import with_robot_numbers
from unmodelled.systems.document import Node, as_node, load_yaml
from unmodelled.systems.given import HasSystem
from unmodelled.systems.model import Parameter, System
from unmodelled.systems.reader import read_system
from unmodelled.systems.units import parse_logged, parse_unit

#: A set: values by name of the parameter (in the unit of the system file, or a text with number and unit), a
#: system of the same structure, or the path of a file with either.
SetGiven: TypeAlias = Mapping[str, float | str] | System | HasSystem | Path | str
#: Sets by name; or their files, by whose names they are called.
SetsGiven: TypeAlias = Mapping[str, SetGiven] | Sequence[Path | str]

#: Name of the numbers of the system file itself.
FILE = "system file"
_AMOUNT = re.compile(r"\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.ASCII)


@dataclass(frozen=True)
class NumberSet:
    """Numbers of a system that somebody believes in."""

    name: str
    values: Mapping[str, float]  # by name of the parameter, in its unit
    source: str = ""  # file, "" where there is none


def number_sets(given: SetsGiven, system: System) -> tuple[NumberSet, ...]:
    """Return the numbers of the system file and all sets; independent faults are told together."""
    faults, found = Faults(), [file_numbers(system)]
    for name, one in _named(given):
        if name in {other.name for other in found}:
            faults.add(f"sets: the name {name!r} is taken: give every set a name of its own")
            continue
        with faults.collected():
            found.append(_read(name, one, system))
    faults.check()
    return tuple(found)


def file_numbers(system: System) -> NumberSet:
    """Return the numbers of a system, which all its experiments share, as a set."""
    values = {p.name: p.value for p in system.parameters if not p.per_experiment}
    return NumberSet(FILE, values, system.source)


def _named(given: SetsGiven) -> Iterator[tuple[str, SetGiven]]:
    if isinstance(given, Mapping):
        yield from ((str(name), one) for name, one in given.items())
        return
    given_as: object = given  # a configuration may hold anything
    if isinstance(given_as, str | Path) or not isinstance(given_as, Sequence):
        raise BadInput("sets: must be a list of files, [tuned.yaml,sheet.yaml] for instance, or sets by name")
    for path in given:
        yield Path(str(path)).stem, Path(str(path))


def _read(name: str, given: Any, system: System) -> NumberSet:
    where = f"sets: {name}"
    if isinstance(given, str | Path):
        node = load_yaml(Path(given), "numbers")
        if "schema" not in node.entries():
            return NumberSet(name, _values(node, system), str(given))
        given, where = read_system(given), str(given)
    elif isinstance(given, Mapping):
        return NumberSet(name, _values(Node(Path(where), 0, "", _nodes(where, given)), system))
    other = given if isinstance(given, System) else getattr(given, "system", None)
    if not isinstance(other, System):
        raise BadInput(f"{where}: must be numbers by name, a system or a file, got {type(given).__name__}")
    other = with_robot_numbers(other)
    _check_structure(where, other, system)
    return NumberSet(name, file_numbers(other).values, other.source)


def _nodes(where: str, given: Mapping[Any, Any]) -> dict[str, Node]:
    """Numbers of a mapping as parts of a file; anything else has no value."""
    amounts = {str(k): v.item() if isinstance(v, np.generic) else v for k, v in given.items()}
    plain = {k: v if isinstance(v, int | float | str) else None for k, v in amounts.items()}
    return {k: as_node(v, Path(where), k) for k, v in plain.items()}


def _check_structure(where: str, other: System, system: System) -> None:
    """Refuse a system that is more than other numbers."""
    parts: dict[str, Callable[[System], object]] = {
        "states": lambda s: [(x.name, x.unit) for x in s.states],
        "inputs": lambda s: [(u.name, u.unit) for u in s.inputs],
        "outputs": lambda s: [(y.name, y.unit, y.expression) for y in s.outputs],
        "parameters": lambda s: {(p.name, parse_unit(p.unit).dimension) for p in s.parameters},
        # numbers of a robot that are no parameters stand in its equations
        "dynamics": lambda s: None if s.robot else s.dynamics,
    }
    for key, part in parts.items():
        if part(other) != part(system):
            raise BadInput(
                f"{where}: {key}: differ from those of {system.place}: sets differ in numbers only; write "
                "the numbers alone into a file (name: value unit)"
            )


def _values(node: Node, system: System) -> dict[str, float]:
    known = {p.name: p for p in system.parameters if not p.per_experiment}
    faults, found = Faults(), dict[str, float]()
    for name, entry in node.entries().items():
        with faults.collected():
            if name not in known:
                raise entry.wrong(f"{system.place} has no parameter {name!r}{closest(name, known)}")
            found[name] = _value(entry, known[name])
    faults.check()
    if not found:
        raise node.wrong("has no numbers: write lines such as J: 0.02 kg m^2")
    return found


def _value(node: Node, parameter: Parameter) -> float:
    matched = _AMOUNT.fullmatch(node.content) if isinstance(node.content, str) else None
    value = float(matched[1]) if matched else math.nan
    if matched is None or not math.isfinite(value):
        example = f"{parameter.value:g} {parameter.unit}"
        raise node.wrong(f"must be a number, with its unit or without, such as {example}")
    if not matched[2]:
        return value
    try:
        unit, logged = parse_logged(matched[2])
    except ValueError as fault:
        raise node.wrong(f"{fault}") from None
    if unit.dimension != parse_unit(parameter.unit).dimension:
        raise node.wrong(f"the unit {matched[2]!r} does not fit: {parameter.name} is in {parameter.unit}")
    return value if logged is None else float(logged.to_si(np.array([value]))[0])
