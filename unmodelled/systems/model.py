"""Symbolic model of a system: states, inputs, outputs, parameters, ports and equations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import sympy as sp

from unmodelled.systems import units
from unmodelled.systems.functions import sanitised
from unmodelled.systems.robot.model import RobotModel
from unmodelled.systems.tables import Table
from unmodelled.systems.units import LoggedUnit, parse_unit

TIME = sp.Symbol("t", real=True)
#: What a port stands for: see `Port`.
Domain = Literal["power", "balance"]


def symbol(name: str) -> sp.Symbol:
    """Return the SymPy symbol of a state, input, parameter, constant or effort."""
    return sp.Symbol(name, real=True)


@dataclass(frozen=True)
class State:
    """State of a system."""

    name: str
    unit: str  # SI unit, as written
    #: value at the start of an experiment, for a state that no output measures: expression of inputs,
    #: parameters, constants and measured states at that time
    initial: sp.Expr = sp.S.Zero


class Logged:
    """Column of a log or of experiments.csv, in a unit of its own."""

    unit: str  # SI unit, as written
    logged: LoggedUnit | None  # unit of the column, where it is not `unit`

    @property
    def column_unit(self) -> str:
        """Return the unit of the column, as written."""
        return self.unit if self.logged is None else self.logged.text

    @property
    def as_written(self) -> LoggedUnit:
        """Return the unit in which a person writes values; that of a column in SI has factor 1, offset 0."""
        return LoggedUnit(self.unit, 1.0, 0.0) if self.logged is None else self.logged

    @property
    def as_difference(self) -> LoggedUnit:
        """Return the unit in which a person writes errors and other differences: K on a scale in degC."""
        written = self.as_written
        plain = written.offset != 0.0 and written.factor == 1.0
        return LoggedUnit(self.unit, 1.0, 0.0) if plain else written.of_differences


@dataclass(frozen=True)
class Input(Logged):
    """Logged input of a system."""

    name: str
    unit: str  # SI unit, as written
    column: str
    delay: float = 0.0  # time by which it acts later than logged, s; negative: earlier
    commanded: bool = True  # whether the log has the set point of a drive, not what acts
    logged: LoggedUnit | None = None  # unit of the column, where it is not `unit`
    #: whether the value is kept until the next sample, as by a digital controller, not a straight line
    hold: bool = False

    @property
    def course(self) -> float:
        """Return the course between samples, see `Integration.hold`: 0 if the value is held, else 1."""
        return 0.0 if self.hold else 1.0


@dataclass(frozen=True)
class Output(Logged):
    """Logged output of a system."""

    name: str
    unit: str  # SI unit, as written
    column: str
    expression: sp.Expr  # measured quantity, of states, inputs, parameters and constants
    delay: float = 0.0  # age of the value that the sensor reports, s
    logged: LoggedUnit | None = None  # unit of the column, where it is not `unit`


@dataclass(frozen=True)
class Constant(Logged):
    """Constant that can differ between experiments (the operating point)."""

    name: str
    unit: str  # SI unit, as written
    #: values by id of the experiment, in `unit`; None: a column of experiments.csv
    values: Mapping[str, float] | None = None
    other: float | None = None  # value for all experiments that `values` does not list
    logged: LoggedUnit | None = None  # unit in which it is written, where that is not `unit`
    #: whether an experiment that `values` does not list has a number of its own, which a simulation fits to
    #: the first half of the experiment from `other` on
    identify: bool = False
    #: lowest and highest plausible value of such a number, in `unit`
    bounds: tuple[float, float] | None = None

    def value(self, experiment: str) -> float | None:
        """Return the value of an experiment, in `unit`, as far as the system file gives it."""
        return (self.values or {}).get(experiment, self.other)


@dataclass(frozen=True)
class Parameter:
    """Constant of the machine."""

    name: str
    unit: str  # SI unit, as written
    value: float  # nominal value, in `unit`
    identify: bool = False  # whether it is uncertain and may be fitted
    bounds: tuple[float, float] | None = None  # lowest and highest plausible value, in `unit`
    per_experiment: bool = False  # whether each has its own, for the unknown start of a state
    guess: bool = False  # whether nobody knows the value, so that others are known in proportion to it only

    @property
    def limits(self) -> tuple[float, float]:
        """Bounds; without them half to twice the value, or no limits if the value is zero."""
        if self.bounds is not None:
            return self.bounds
        if self.value == 0.0:
            return -float("inf"), float("inf")
        low, high = sorted((0.5 * self.value, 2.0 * self.value))
        return low, high


@dataclass(frozen=True)
class Port:
    """Place in the equations where an effort (force, torque, voltage) can act that the model leaves out."""

    name: str
    effort: str  # symbol of the effort in the equations; zero in the known model
    unit: str  # SI unit of the effort
    position: str | None = None  # name of a state or signal
    velocity: str | None = None  # name of a state or signal
    law: sp.Expr | None = None  # known part of the effort, of states, inputs and parameters
    #: state, input or signal that is the effort which the gear or screw at the port carries, in `unit`
    load: str | None = None
    #: "power" if effort times velocity is a power; "balance" if the effort is what leaves a balance of heat,
    #: fluid or charge per time, and the position is its level; None: see `domain`
    kind: Domain | None = None

    @property
    def domain(self) -> Domain:
        """Kind of the port: the one given, or else power for a port with a velocity, a force or a torque."""
        if self.kind is not None:
            return self.kind
        return "power" if self.mechanical or self.velocity is not None else "balance"

    @property
    def mechanical(self) -> bool:
        """Whether the effort is a force or a torque, or has no unit."""
        return parse_unit(self.unit).dimension in {parse_unit(unit).dimension for unit in ("N", "N m", "1")}

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the port's position and velocity, without those that it lacks."""
        return tuple(name for name in (self.position, self.velocity) if name is not None)


@dataclass(frozen=True)
class Event:
    """Time at which an expression first falls through zero."""

    name: str
    expression: sp.Expr  # of states, inputs, parameters, constants and t
    then: tuple[sp.Expr, ...] | None = None  # dynamics of every state after the event; None: unchanged


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
            "inputs": [_named(u.name, u.unit) for u in self.inputs],
            "outputs": [_named(y.name, y.unit) for y in self.outputs],
            "operating point": [_named(c.name, c.unit) for c in self.operating_point],
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
