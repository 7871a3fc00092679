"""Reader of the sections of a system file that declare names, units and numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from unmodelled.base.errors import Faults
from unmodelled.systems import units
from unmodelled.systems.characteristics import read_table
from unmodelled.systems.document import Node, flag
from unmodelled.systems.model import Constant, Domain, Input, Output, Parameter, Port, State, symbol
from unmodelled.systems.names import Names, checked_name
from unmodelled.systems.syntax import shown
from unmodelled.systems.tables import Table
from unmodelled.systems.units import Unit

_LOG_COLUMNS = ("id", "file", "group")
#: Sections that declare no name of an expression.
_OTHER = ("schema", "name", "outputs", "dynamics")
#: Optional keys of a number that can be fitted.
_FITTED = ("identify", "bounds", "per_experiment")


@dataclass
class Declarations:
    """Declarations of a system file, in its order; outputs and ports do not have their expressions yet."""

    states: list[State] = field(default_factory=list)  # without initial values that are texts
    inputs: list[Input] = field(default_factory=list)
    outputs: list[Output] = field(default_factory=list)  # with the symbol of their names as expression
    operating_point: list[Constant] = field(default_factory=list)
    parameters: list[Parameter] = field(default_factory=list)
    ports: list[Port] = field(default_factory=list)  # without their known laws
    tables: list[Table] = field(default_factory=list)
    names: Names = field(default_factory=Names)
    units: dict[str, Unit] = field(default_factory=dict)  # also those of efforts
    output_units: dict[str, Unit] = field(default_factory=dict)
    faulty: set[str] = field(default_factory=set)  # names with a fault; what uses them cannot be checked

    @property
    def without_units(self) -> bool:
        """Whether no entry of the file has a unit, so that units are not checked at all."""
        return all(u.dimension == units.ONE for u in (*self.units.values(), *self.output_units.values()))


def read_declarations(sections: dict[str, Node], faults: Faults) -> Declarations:
    """Read the names, units and numbers of all sections."""
    found = Declarations()
    readers = {
        "states": _state,
        "inputs": _input,
        "operating_point": _constant,
        "parameters": _parameter,
        "tables": _table,
        "ports": _port,
    }
    for section, read in readers.items():
        for name, node in _entries(sections, section, faults):
            with faults.collected():
                read(found, name, node)
    for section, kind in (("signals", "signal"), ("events", "event")):
        for name, node in _entries(sections, section, faults):
            with faults.collected():
                found.names.add(name, kind, node)
    found.faulty = _faulty(sections, found)
    for name, node in _entries(sections, "outputs", faults):
        if name not in found.faulty:  # outputs show states and signals
            with faults.collected():
                _output(found, name, node)
    for section in ("states", "outputs"):
        if section in sections and sections[section].content in (None, {}):
            faults.add(str(sections[section].wrong("at least one is needed: add it")))
    return found


def _entries(sections: dict[str, Node], section: str, faults: Faults) -> Iterable[tuple[str, Node]]:
    """Return the entries of a section; of one that is missing or no mapping there are none."""
    found: dict[str, Node] = {}
    with faults.collected():
        found = sections[section].entries() if section in sections else {}
    return found.items()


def _faulty(sections: dict[str, Node], found: Declarations) -> set[str]:
    """Return the names whose declaration was refused; of a port also that of its effort."""
    groups = (found.states, found.inputs, found.operating_point, found.parameters, found.tables, found.ports)
    sound = {item.name for group in groups for item in group}
    sound |= {name for name, (kind, _) in found.names.kinds.items() if kind in ("signal", "event")}
    ignored = Faults()  # they were collected before
    declared = {
        name: node for key in sections if key not in _OTHER for name, node in _entries(sections, key, ignored)
    }
    faulty = {name for name in declared if name not in sound}
    ports = sections["ports"].content if "ports" in sections else None
    for name, node in ports.items() if isinstance(ports, dict) else ():
        effort = node.content.get("effort") if isinstance(node.content, dict) else None
        if name in faulty and effort is not None and isinstance(effort.content, str):
            faulty.add(effort.content)
        elif name in faulty:
            found.names.refused = True
    return faulty


def _unit(node: Node) -> Unit:
    try:
        return units.parse_unit("" if node.content is None else node.text())
    except ValueError as error:
        raise node.wrong(str(error)) from None


def _logged_unit(node: Node) -> tuple[Unit, units.LoggedUnit | None]:
    """The SI unit of a signal, and the unit of its column if that is another one."""
    try:
        return units.parse_logged("" if node.content is None else node.text())
    except ValueError as error:
        raise node.wrong(str(error)) from None


def _in_si(node: Node, logged: units.LoggedUnit | None) -> float:
    value = node.number()
    return value if logged is None else float(logged.to_si(np.asarray(value)))


def _delay(entries: dict[str, Node]) -> float:
    return entries["delay"].number() if "delay" in entries else 0.0


def _column(name: str, entries: dict[str, Node]) -> str:
    column = entries["column"].text() if "column" in entries else name
    if column == "t" or not column.isprintable():
        node = entries.get("column") or entries["unit"]
        raise node.wrong(f"a log column, other than the time t, is needed, got {shown(column)}")
    return column


def _state(found: Declarations, name: str, node: Node) -> None:
    entries = node.fields(("unit",), ("initial",))
    found.names.add(name, "state", node)
    unit = found.units[name] = _unit(entries["unit"])
    initial = entries.get("initial")
    if initial is None or isinstance(initial.content, str):
        found.states.append(State(name, unit.text))
        return
    fitted = found.names.add(f"{name}_0", "parameter", initial)
    found.units[fitted] = unit
    found.parameters.append(_number(fitted, unit, initial.fields(("value",), _FITTED)))
    found.states.append(State(name, unit.text, symbol(fitted)))


def _input(found: Declarations, name: str, node: Node) -> None:
    entries = node.fields(("unit",), ("column", "delay", "commanded", "hold"))
    found.names.add(name, "input", node)
    unit, logged = _logged_unit(entries["unit"])
    found.units[name] = unit
    commanded = flag(entries, "commanded", True)
    hold = flag(entries, "hold")
    column, delay = _column(name, entries), _delay(entries)
    found.inputs.append(Input(name, unit.text, column, delay, commanded, logged, hold))


def _output(found: Declarations, name: str, node: Node) -> None:
    entries = node.fields(("unit",), ("column", "expression", "delay"))
    kind, line = found.names.kinds.get(name, ("state", 0))
    if kind not in ("state", "signal"):
        raise node.wrong(f"the name {shown(name)} is taken by the {kind} of line {line}: choose another name")
    if "expression" not in entries and name not in {s.name for s in found.states}:
        raise node.wrong("no state has this name: give an expression")
    checked_name(name, node)
    unit, logged = _logged_unit(entries["unit"])
    found.output_units[name] = unit
    column, delay = _column(name, entries), _delay(entries)
    if delay < 0:
        raise entries["delay"].wrong(f"must not be negative, got {delay:g}: a sensor cannot show the future")
    if any(i.column == column and i.logged != logged for i in found.inputs):
        raise entries["unit"].wrong(f"an input has the column {shown(column)} in another unit: give the same")
    if column in {o.column for o in found.outputs}:
        raise node.wrong(f"the column {shown(column)} is already an output: name another column")
    found.outputs.append(Output(name, unit.text, column, symbol(name), delay, logged))


def _constant(found: Declarations, name: str, node: Node) -> None:
    entries = node.fields(("unit",), ("values", "other", "identify", "bounds"))
    if name in _LOG_COLUMNS:
        raise node.wrong(
            f"the name {shown(name)} is a column of its own in experiments.csv: choose another name"
        )
    found.names.add(name, "operating point", node)
    unit, logged = _logged_unit(entries["unit"])
    found.units[name] = unit
    given = entries["values"].entries() if "values" in entries else None
    other = _in_si(entries["other"], logged) if "other" in entries else None
    if given is None and other is not None:
        raise entries["other"].wrong(
            "must have values beside it: without them the constant is a column of experiments.csv"
        )
    if given is not None and not given and other is None:
        raise entries["values"].wrong("must have at least one value, or other")
    own = _own_number(entries, other, logged)
    if given is None:
        found.operating_point.append(Constant(name, unit.text, logged=logged))
        return
    values = {key: _in_si(value, logged) for key, value in given.items()}
    found.operating_point.append(Constant(name, unit.text, values, other, logged, *own))


def _own_number(
    entries: dict[str, Node], other: float | None, logged: units.LoggedUnit | None
) -> tuple[bool, tuple[float, float] | None]:
    """Whether an experiment that is not listed has a number of its own, and its bounds."""
    identify = flag(entries, "identify")
    if identify and other is None:
        raise entries["identify"].wrong("must have other beside it, the value that a fit starts from")
    if "bounds" not in entries:
        return identify, None
    low, high = entries["bounds"].pair()
    if logged is not None:
        low, high = logged.to_si(np.array([low, high])).tolist()
    if not identify or other is None or not low <= other <= high:
        raise entries["bounds"].wrong("must have identify: true beside it, and contain the value of other")
    return identify, (low, high)


def _parameter(found: Declarations, name: str, node: Node) -> None:
    entries = node.fields(("value", "unit"), (*_FITTED, "guess"))
    found.names.add(name, "parameter", node)
    unit = found.units[name] = _unit(entries["unit"])
    guess = flag(entries, "guess")
    found.parameters.append(replace(_number(name, unit, entries), guess=guess))


def _number(name: str, unit: Unit, entries: dict[str, Node]) -> Parameter:
    value = entries["value"].number()
    identify = flag(entries, "identify")
    bounds = entries["bounds"].pair() if "bounds" in entries else None
    if bounds is not None and not bounds[0] <= value <= bounds[1]:
        low, high = bounds
        raise entries["bounds"].wrong(f"must contain the value {value:g}, got [{low:g}, {high:g}]")
    per_experiment = flag(entries, "per_experiment")
    if per_experiment and not identify:
        raise entries["per_experiment"].wrong("such a number is fitted: add identify: true")
    return Parameter(name, unit.text, value, identify, bounds, per_experiment)


def _table(found: Declarations, name: str, node: Node) -> None:
    found.names.add(name, "table", node)
    found.tables.append(read_table(name, node))


def _port(found: Declarations, name: str, node: Node) -> None:
    entries = node.fields(("effort", "unit"), ("position", "velocity", "law", "load", "kind"))
    checked_name(name, node)
    effort = found.names.add(entries["effort"].text(), "effort", entries["effort"])
    unit = found.units[effort] = _unit(entries["unit"])
    named = {k: entries[k].text() for k in ("position", "velocity", "load") if k in entries}
    found.ports.append(Port(name, effort, unit.text, **named, kind=_domain(entries)))


def _domain(entries: dict[str, Node]) -> Domain | None:
    match entries["kind"].text() if "kind" in entries else None:
        case None:
            return None
        case "power":
            return "power"
        case "balance" if "velocity" in entries:
            raise entries["velocity"].wrong("a balance has no velocity: remove this key, or kind: balance")
        case "balance":
            return "balance"
        case written:
            raise entries["kind"].wrong(f"must be power or balance, got {shown(str(written))}")
