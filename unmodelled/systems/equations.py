"""Reader of the expressions of a system file: signals, dynamics, outputs, laws and events."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import sympy as sp

from unmodelled.base.errors import Faults, closest
from unmodelled.systems import grammar, quantities, syntax, units
from unmodelled.systems.declarations import Declarations
from unmodelled.systems.document import Node
from unmodelled.systems.domains import by_units
from unmodelled.systems.model import Event, Output, Port, State, System, symbol
from unmodelled.systems.quantities import UNKNOWN, Quantity
from unmodelled.systems.robot.model import RobotModel
from unmodelled.systems.scope import Scope, Value
from unmodelled.systems.syntax import shown
from unmodelled.systems.units import Dimension, Unit

T = TypeVar("T")

_LARGEST = 100_000
_KELVIN = units.parse_unit("K").dimension


class _UsesFaulty(Exception):
    """An expression uses a name whose declaration has a fault, so that it cannot be checked."""


@dataclass
class Equations:
    """Expressions of a file, each checked for the names that it can use."""

    sections: dict[str, Node]
    declared: Declarations
    robot: RobotModel | None = None
    values: dict[str, Value] = field(default_factory=dict)
    text: dict[str, str] = field(default_factory=dict)
    size: int = 0
    remarks: list[str] = field(default_factory=list)
    faults: Faults = field(default_factory=Faults)

    def system(self, name: str) -> System:
        """Return the system, or refuse all faults that were found."""
        declared = self.declared
        constants = {*self._entries("operating_point"), *self._entries("parameters")}
        for key, unit in declared.units.items():
            dimension = None if declared.without_units else unit.dimension
            self.values[key] = Value(symbol(key), Quantity(dimension, constant=key in constants))
        signals = self._signals()
        declared.faulty.update(name for name in self._entries("signals") if name not in signals)
        before = len(self.faults)
        dynamics = self._dynamics()
        whole = len(self.faults) == before and len(dynamics) == len(self._entries("states"))
        outputs = self._each(self._output, [(output,) for output in declared.outputs])
        states = self._each(self._state, [(state,) for state in declared.states])
        ports = self._each(self._port, [(port, dynamics if whole else None) for port in declared.ports])
        events = [(n, node, dynamics) for n, node in self._entries("events").items() if whole]
        found = self._each(self._event, events)
        self.faults.check()
        return System(
            name,
            states,
            tuple(declared.inputs),
            outputs,
            tuple(declared.operating_point),
            tuple(declared.parameters),
            ports,
            tuple(declared.tables),
            signals,
            dynamics,
            self.text,
            found,
            remarks=tuple(self.remarks),
            robot=self.robot,
        )

    def _each(self, read: Callable[..., T], entries: Iterable[tuple[Any, ...]]) -> tuple[T, ...]:
        """Read all entries, and collect the faults of each."""
        found = []
        for entry in entries:
            if self.size > _LARGEST:  # a fault that ends the work
                break
            with self.faults.collected(), suppress(_UsesFaulty):
                found.append(read(*entry))
        return tuple(found)

    def _entries(self, section: str) -> dict[str, Node]:
        content = self.sections[section].content if section in self.sections else None
        return content if isinstance(content, dict) else {}

    def _scope(self, refused: dict[str, str]) -> Scope:
        declared = self.declared
        tables = {table.name: k for k, table in enumerate(declared.tables)}
        functions = {} if self.robot is None else self.robot.functions
        return Scope(self.values, tables, [s.name for s in declared.states], refused, functions)

    def _evaluated(self, node: Node, refused: dict[str, str], unit: Unit | Dimension | None = None) -> Value:
        self.text[node.place] = node.text()
        self._check_sound(*_words(node))
        value = grammar.evaluate(node.text(), self._scope(refused), node.where)
        self.size += value.size
        if self.size > _LARGEST:
            raise node.wrong(
                "all expressions together are too large once their signals are inserted: simplify them"
            )
        if unit is not None:
            self._check_unit(node, value, unit)
        return value

    def _check_sound(self, *names: str | None) -> None:
        if self.declared.faulty & {*names}:
            raise _UsesFaulty

    def _check_unit(self, node: Node, value: Value, unit: Unit | Dimension) -> None:
        got = value.quantity.settled
        dimension = unit.dimension if isinstance(unit, Unit) else unit
        if got is None or self.declared.without_units or got == dimension:
            return
        wanted = unit.text if isinstance(unit, Unit) and unit.text else units.describe(dimension)
        celsius = ": C is coulomb; degrees Celsius are degC" if wanted == "C" and got == _KELVIN else ""
        raise node.wrong(f"unit must be {wanted}, got {units.describe(got)}{celsius}")

    def _signals(self) -> dict[str, sp.Expr]:
        entries = self._entries("signals")
        uses = {name: [n for n in _words(node) if n in entries] for name, node in entries.items()}
        met, disorder = set[str](), False

        def read(name: str, node: Node) -> None:
            nonlocal disorder
            missing = next((used for used in uses[name] if used not in met), None)
            met.add(name)
            if missing is not None and not disorder:  # all signals of a cycle have the same fault
                disorder = True
                raise node.wrong(syntax.out_of_order(name, missing, uses))
            if all(used in self.values for used in uses[name]):  # else a signal that it uses has a fault
                self.values[name] = self._evaluated(node, {})

        self._each(read, entries.items())
        return {name: self.values[name].expression for name in entries if name in self.values}

    def _dynamics(self) -> tuple[sp.Expr, ...]:
        given = self._entries("dynamics")
        found = self._rates(given)
        for state in self.declared.states if "dynamics" in self.sections else ():
            if state.name not in given:
                words = f"the state {state.name!r} has no dynamics: add its time derivative"
                self.faults.add(str(self.sections["dynamics"].wrong(words)))
        return tuple(found[state.name] for state in self.declared.states if state.name in found)

    def _rates(self, entries: dict[str, Node]) -> dict[str, sp.Expr]:
        """Return the time derivatives of the states that have an entry, in the order of the states."""
        states = [s.name for s in self.declared.states]
        found = {}

        def read(name: str) -> None:
            self._check_sound(name)
            if name not in states:
                wrong = f"{shown(name)} is not a state, must be one of {', '.join(sorted(states))}"
                raise entries[name].wrong(wrong)
            unit = Quantity(self.declared.units[name].dimension)
            rate = quantities.quotient(unit, quantities.CLOCK).dimension
            found[name] = self._evaluated(entries[name], {}, rate).expression

        others = [name for name in entries if name not in states]
        self._each(read, [(name,) for name in (*others, *(s for s in states if s in entries))])
        return found

    def _event(self, name: str, node: Node, dynamics: tuple[sp.Expr, ...]) -> Event:
        entries = node.fields(("expression",), ("then",))
        written = entries["expression"]
        expression = self._evaluated(written, self._without_efforts()).expression
        moving = {*self._entries("states"), *self._entries("inputs"), "t"}
        if not moving & {str(s) for s in expression.free_symbols}:
            raise written.wrong(
                "depends on no state, no input and not on t, so that the event never happens: use one of them"
            )
        if "then" not in entries:
            return Event(name, expression)
        changed = self._rates(entries["then"].entries())
        if not entries["then"].entries():
            raise entries["then"].wrong("at least one state is needed: add its dynamics, or remove then")
        pairs = zip(self.declared.states, dynamics, strict=True)
        return Event(name, expression, tuple(changed.get(state.name, rate) for state, rate in pairs))

    def _without_efforts(self) -> dict[str, str]:
        """Return the names that are refused (efforts and signals that depend on them) with the reason."""
        efforts = {symbol(p.effort): p.effort for p in self.declared.ports}
        refused = {e: f"the effort {e!r} is not allowed here" for e in efforts.values()}
        for name in self._entries("signals").keys() & self.values.keys():
            inside = self.values[name].expression.free_symbols & efforts.keys()
            if inside:
                effort = min(efforts[s] for s in inside)
                refused[name] = f"{name!r} depends on the effort {effort!r}, which is not allowed here"
        return refused

    def _state(self, state: State) -> State:
        written = self._entries("states")[state.name].entries().get("initial")
        if written is None:
            return state
        if not isinstance(written.content, str):
            self.text[written.place] = str(state.initial)
            return state
        if written.is_number:
            return replace(state, initial=sp.Float(written.number()))
        known = self._evaluated(written, {}, self.declared.units[state.name])
        return replace(state, initial=known.expression)

    def _output(self, output: Output) -> Output:
        node = self._entries("outputs")[output.name]
        unit = self.declared.output_units[output.name]
        if "expression" not in node.entries():
            self._check_sound(output.name)
            self._check_unit(node, self.values[output.name], unit)
            return output
        written = node.entries()["expression"]
        return replace(output, expression=self._evaluated(written, {}, unit).expression)

    def _port(self, port: Port, dynamics: tuple[sp.Expr, ...] | None) -> Port:
        """Check a port; with `dynamics` only if none of them has a fault."""
        node = self._entries("ports")[port.name]
        effort = symbol(port.effort)
        self._check_sound(port.position, port.velocity, port.load)
        if dynamics is not None and not any(effort in f.free_symbols for f in dynamics):
            raise node.wrong(
                f"effort {port.effort!r} of port {port.name!r} appears in no dynamics: add it where it acts"
            )
        refused = self._without_efforts()
        motions = [*(s.name for s in self.declared.states), *self._entries("signals")]
        carried = [*motions, *(i.name for i in self.declared.inputs)]
        for key, known, what in (
            ("position", motions, "a state or a signal"),
            ("velocity", motions, "a state or a signal"),
            ("load", carried, "an input, a state or a signal"),
        ):
            if key in node.entries():
                self._check_named(node.entries()[key], known, what, refused)
        if port.load is not None:
            self._check_unit(node.entries()["load"], self.values[port.load], self.declared.units[port.effort])
        port = self._by_units(port)
        self._check_power(port, node)
        if "law" not in node.entries():
            return port
        law = self._evaluated(node.entries()["law"], refused, self.declared.units[port.effort])
        return replace(port, law=law.expression)

    def _check_named(self, node: Node, known: Sequence[str], what: str, refused: dict[str, str]) -> None:
        name = node.text()
        if name not in known and not name.isidentifier():
            raise node.wrong(
                f"must be {what}, got the expression {shown(name)}: name it in signals, and write that name"
            )
        if name not in known:
            raise node.wrong(f"must be {what}, got {shown(name)}{closest(name, known)}")
        if name in refused:
            raise node.wrong(refused[name])

    def _by_units(self, port: Port) -> Port:
        """A port whose coordinate is what its units say, with a remark if the file calls it otherwise."""
        if port.kind is not None or len(port.coordinates) != 1 or self.declared.without_units:
            return port
        effort, coordinate = (self.values[n].quantity.settled for n in (port.effort, *port.coordinates))
        if effort is None or coordinate is None:
            return port
        found, remark = by_units(port, effort, coordinate)
        self.remarks += [remark] if remark else []
        return found

    def _check_power(self, port: Port, node: Node) -> None:
        if port.velocity is None:
            return
        rate = self.values[port.velocity].quantity.settled
        states = {s.name for s in self.declared.states}
        if not port.mechanical and {*port.coordinates} <= states:
            return  # a note of the system: the units of all that laws read are known
        power = quantities.product(self.values[port.effort].quantity, Quantity(rate) if rate else UNKNOWN)
        if power.settled not in (None, units.parse_unit("W").dimension):
            got = units.describe(power.settled)
            raise node.wrong(
                f"effort times velocity must be a power, in W, got {got}: check the units of both"
            )


def _words(node: Node) -> list[str]:
    return syntax.names(node.content) if isinstance(node.content, str) else []
