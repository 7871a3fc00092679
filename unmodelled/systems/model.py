"""Symbolic model of a system: its parts and its equations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field, replace
from functools import cached_property

import sympy as sp

from unmodelled.systems import units
from unmodelled.systems.functions import sanitised
from unmodelled.systems.parts import TIME as TIME
from unmodelled.systems.parts import Constant as Constant
from unmodelled.systems.parts import Domain as Domain
from unmodelled.systems.parts import Event as Event
from unmodelled.systems.parts import Input as Input
from unmodelled.systems.parts import Logged as Logged
from unmodelled.systems.parts import Output as Output
from unmodelled.systems.parts import Parameter as Parameter
from unmodelled.systems.parts import Port as Port
from unmodelled.systems.parts import State as State
from unmodelled.systems.parts import symbol as symbol
from unmodelled.systems.robot.model import RobotModel
from unmodelled.systems.tables import Table
from unmodelled.systems.units import parse_unit


@dataclass(frozen=True, repr=False)
class System:
    """Model x' = f(t, x, u, efforts; p), y = g(x, u; p) of a machine; immutable.

    Attributes:
        name: name in the system file.
        states: states x, in the order of the file.
        inputs: logged inputs u, in the order of the file.
        outputs: logged outputs y, in the order of the file.
        operating_point: constants that can differ between experiments.
        parameters: parameters p, constants of the machine.
        ports: places where efforts can act that the model leaves out.
        tables: characteristics that expressions can use.
        signals: expressions by name, in terms of states, inputs, parameters, constants, efforts and t only.
        dynamics: time derivative of each state, in the same terms.
        text: expressions as written in the file, by dotted path (signals.F_m, dynamics.v, ports.rail.law);
            default none.
        events: events that the model predicts; default none.
        source: file that the system was read from, "" where there is none; not compared.
        remarks: notes on ports that the file calls otherwise than their units; not compared, default none.
        robot: robot whose equations are part of the system; default None.
    """

    name: str
    states: tuple[State, ...]
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    operating_point: tuple[Constant, ...]
    parameters: tuple[Parameter, ...]
    ports: tuple[Port, ...]
    tables: tuple[Table, ...]
    signals: Mapping[str, sp.Expr]
    dynamics: tuple[sp.Expr, ...]
    text: Mapping[str, str] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    source: str = field(default="", compare=False)
    remarks: tuple[str, ...] = field(default=(), compare=False)
    robot: RobotModel | None = None

    def __repr__(self) -> str:
        entries = {
            "states": [_named(s.name, s.unit) for s in self.states],
            "inputs": [_named(u.name, u.column_unit) for u in self.inputs],
            "outputs": [_named(y.name, y.column_unit) for y in self.outputs],
            "operating point": [_named(c.name, c.column_unit) for c in self.operating_point],
            "parameters": [
                f"{p.name} = {p.value:g} {_plain(p.unit)}".rstrip() + ", to be identified" * p.identify
                for p in self.parameters
            ],
            "ports": [
                _named(p.name, p.unit) + (f" = {p.law}" if p.law is not None else "") for p in self.ports
            ],
            "events": [event.name for event in self.events],
        }
        rates = [
            f"  {s.name}' = {rate if self.robot is None else self.text.get(f'dynamics.{s.name}', rate)}"
            for s, rate in zip(self.states, self.dynamics, strict=True)
        ]
        lines = [f"{name}: {'; '.join(each)}" for name, each in entries.items() if each]
        return "\n".join([f"system {self.name}", *lines, "dynamics:", *rates])

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Notes on what the equations leave out of a robot, and on ports whose units say something else."""
        rates = {state.name: state.unit for state in self.states}
        found = [] if self.robot is None else [f"{self.robot.file}: {note}" for note in self.robot.notes]
        found += self.remarks
        for port in self.ports:
            if port.velocity not in rates or port.domain != "power":
                continue
            power = units.times(parse_unit(port.unit).dimension, parse_unit(rates[port.velocity]).dimension)
            if power not in (parse_unit("W").dimension, units.ONE):
                found.append(
                    f"ports.{port.name}: effort times velocity is in {units.describe(power)}, which is "
                    "no power in W: the laws of mechanics are tried as they are"
                )
        return tuple(found)

    @property
    def place(self) -> str:
        """Return how a message about the system begins: its file, or its name where it has none."""
        return self.source or f"system {self.name}"

    def states_behind(self, expressions: Iterable[sp.Expr], apart: Set[sp.Symbol]) -> list[int]:
        """Return the numbers of the states that expressions depend on, also through the rates of such states.

        Args:
            expressions: expressions of the system's symbols.
            apart: symbols of states that do not count, and whose rates are not followed.

        Examples:
            >>> from pathlib import Path
            >>> from unmodelled.systems.reader import read_system
            >>> system = read_system(Path("systems/pendulum.yaml"))
            >>> theta, omega = system.x
            >>> system.states_behind([2 * theta], set()), system.states_behind([2 * theta], {omega})
            ([0, 1], [0])
        """
        numbers = {x: k for k, x in enumerate(self.x) if x not in apart}
        found, todo = set[int](), [*expressions]
        while todo:
            new = {numbers[x] for x in todo.pop().free_symbols & numbers.keys()} - found
            found |= new
            todo += [self.dynamics[k] for k in new]
        return sorted(found)

    @cached_property
    def x(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the states."""
        return tuple(symbol(s.name) for s in self.states)

    @cached_property
    def u(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the inputs."""
        return tuple(symbol(s.name) for s in self.inputs)

    @cached_property
    def p(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the parameters."""
        return tuple(symbol(s.name) for s in self.parameters)

    @cached_property
    def c(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the constants of the operating point."""
        return tuple(symbol(s.name) for s in self.operating_point)

    @cached_property
    def e(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the efforts, one per port."""
        return tuple(symbol(s.effort) for s in self.ports)

    @cached_property
    def closed(self) -> tuple[sp.Expr, ...]:
        """Dynamics with every known law inserted; the symbol of an effort is what acts beside its law."""
        laws = {symbol(p.effort): symbol(p.effort) + p.law for p in self.ports if p.law is not None}
        return tuple(sanitised(f.xreplace(laws)) for f in self.dynamics)

    def expression(self, name: str) -> sp.Expr:
        """Return a state, input, signal, constant or parameter as an expression.

        Args:
            name: name in the system file.

        Returns:
            Expression of a signal, or symbol of the others.

        Raises:
            KeyError: if the system has no such name.
        """
        if name in self.signals:
            return self.signals[name]
        if name in {str(s) for s in (*self.x, *self.u, *self.p, *self.c)}:
            return symbol(name)
        raise KeyError(name)

    def port(self, name: str) -> Port:
        """Return a port by its name.

        Args:
            name: name in the system file.

        Returns:
            The port.

        Raises:
            KeyError: if the system has no such port.
        """
        return {p.name: p for p in self.ports}[name]

    @property
    def port_names(self) -> tuple[str, ...]:
        """Names of the ports."""
        return tuple(p.name for p in self.ports)

    @property
    def values(self) -> tuple[float, ...]:
        """Nominal values of the parameters, in their SI units."""
        return tuple(p.value for p in self.parameters)

    @property
    def uncertain(self) -> tuple[str, ...]:
        """Names of the parameters that the file marks with `identify`, and that all experiments share."""
        return tuple(p.name for p in self.parameters if p.identify and not p.per_experiment)

    def with_values(self, values: Mapping[str, float]) -> System:
        """Return the system with other values of some parameters.

        Args:
            values: new values by name of the parameter, in SI units; other names are ignored.

        Returns:
            System that differs in these values only.

        Examples:
            >>> from pathlib import Path
            >>> from unmodelled.systems.reader import read_system
            >>> read_system(Path("systems/pendulum.yaml")).with_values({"J": 0.03}).values
            (0.03, 0.01, 1.2)
        """
        parameters = tuple(replace(p, value=float(values.get(p.name, p.value))) for p in self.parameters)
        return replace(self, parameters=parameters)


def _named(name: str, unit: str) -> str:
    """A name with its unit, if there is one."""
    return f"{name} ({unit})" if _plain(unit) else name


def _plain(unit: str) -> str:
    """A unit; nothing for that of a pure number."""
    return "" if unit in ("1", "-") else unit
