"""The symbolic model of a system: states, inputs, outputs, parameters, ports, and their equations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import sympy as sp

from unmodelled.systems.functions import sanitised
from unmodelled.systems.tables import Table

TIME = sp.Symbol("t", real=True)


def symbol(name: str) -> sp.Symbol:
    """The SymPy symbol of a state, input, parameter, constant of an operating point or effort."""
    return sp.Symbol(name, real=True)


@dataclass(frozen=True)
class State:
    """A state. `initial` counts where no output measures it."""

    name: str
    unit: str
    initial: float = 0.0


@dataclass(frozen=True)
class Input:
    """A logged input; it acts `delay` seconds later, or earlier where the delay is negative."""

    name: str
    unit: str
    column: str
    delay: float = 0.0


@dataclass(frozen=True)
class Output:
    """A logged output: what the sensor shows of the state `delay` seconds ago."""

    name: str
    unit: str
    column: str
    expression: sp.Expr
    delay: float = 0.0


@dataclass(frozen=True)
class Constant:
    """A constant of one experiment.

    Attributes:
        name, unit: of the constant.
        values: by id of the experiment; None where it is a column of experiments.csv.
        other: of experiments that `values` lacks, if it is known.
    """

    name: str
    unit: str
    values: Mapping[str, float] | None = None
    other: float | None = None


@dataclass(frozen=True)
class Parameter:
    """A constant of the machine, SI. `identify` says that it is uncertain, within `bounds`."""

    name: str
    unit: str
    value: float
    identify: bool = False
    bounds: tuple[float, float] | None = None

    @property
    def limits(self) -> tuple[float, float]:
        """The bounds; without any, half to twice the value, or anything if the value is zero."""
        if self.bounds is not None:
            return self.bounds
        if self.value == 0.0:
            return -float("inf"), float("inf")
        low, high = sorted((0.5 * self.value, 2.0 * self.value))
        return low, high


@dataclass(frozen=True)
class Port:
    """Where an effort that the model leaves out can act.

    Attributes:
        name: of the port. effort: its symbol in the equations. unit: of the effort.
        position, velocity: names of states or signals, if the port has them.
        law: of the effort that is known, in terms of states, inputs and parameters.
    """

    name: str
    effort: str
    unit: str
    position: str | None = None
    velocity: str | None = None
    law: sp.Expr | None = None

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of position and velocity, as far as the port has them."""
        return tuple(name for name in (self.position, self.velocity) if name is not None)


@dataclass(frozen=True)
class Event:
    """The moment when `expression` first falls through zero.

    Attributes:
        name: of the event. expression: in terms of states, inputs, parameters, constants and t.
        then: dynamics of every state from there on, if they change.
    """

    name: str
    expression: sp.Expr
    then: tuple[sp.Expr, ...] | None = None


@dataclass(frozen=True, repr=False)
class System:
    """x' = f(t, x, u, efforts; p), y = g(x, u; p). Immutable.

    Attributes:
        name: of the system.
        states, inputs, outputs, operating_point, parameters, ports, tables: in the order of the file.
        signals: named expressions, in terms of states, inputs, parameters, constants, efforts and t only.
        dynamics: one expression per state, in the same terms.
        events: moments that the model predicts.
        text: dotted path in the file (signals.F_m, dynamics.v, ports.rail.law) -> expression as written.
        source: file that the system was read from, "" where there is none; systems of two files can be equal.
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
        rates = [f"  {s.name}' = {rate}" for s, rate in zip(self.states, self.dynamics, strict=True)]
        lines = [f"{name}: {'; '.join(each)}" for name, each in entries.items() if each]
        return "\n".join([f"system {self.name}", *lines, "dynamics:", *rates])

    @property
    def place(self) -> str:
        """Return how a message about the system begins: its file, or its name where it has none."""
        return self.source or f"system {self.name}"

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
        """Symbols of the operating point."""
        return tuple(symbol(s.name) for s in self.operating_point)

    @cached_property
    def e(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the efforts, one per port."""
        return tuple(symbol(s.effort) for s in self.ports)

    @cached_property
    def closed(self) -> tuple[sp.Expr, ...]:
        """The dynamics with every known law in place; an effort's symbol stands for what is added to it."""
        laws = {symbol(p.effort): symbol(p.effort) + p.law for p in self.ports if p.law is not None}
        return tuple(sanitised(f.xreplace(laws)) for f in self.dynamics)

    def expression(self, name: str) -> sp.Expr:
        """The state, input or signal `name`, or the constant or parameter.

        Raises:
            KeyError: when there is none.
        """
        if name in self.signals:
            return self.signals[name]
        if name in {str(s) for s in (*self.x, *self.u, *self.p, *self.c)}:
            return symbol(name)
        raise KeyError(name)

    def port(self, name: str) -> Port:
        """The port `name`.

        Raises:
            KeyError: when there is none.
        """
        return {p.name: p for p in self.ports}[name]

    @property
    def port_names(self) -> tuple[str, ...]:
        """Names of the ports."""
        return tuple(p.name for p in self.ports)

    @property
    def values(self) -> tuple[float, ...]:
        """Values of the parameters, SI."""
        return tuple(p.value for p in self.parameters)

    @property
    def uncertain(self) -> tuple[str, ...]:
        """Names of the parameters that are to be identified."""
        return tuple(p.name for p in self.parameters if p.identify)

    def with_values(self, values: Mapping[str, float]) -> System:
        """The same system with other values of some parameters."""
        parameters = tuple(replace(p, value=float(values.get(p.name, p.value))) for p in self.parameters)
        return replace(self, parameters=parameters)


def _named(name: str, unit: str) -> str:
    """A name with its unit, if there is one."""
    return f"{name} ({unit})" if _plain(unit) else name


def _plain(unit: str) -> str:
    """A unit; nothing for that of a pure number."""
    return "" if unit in ("1", "-") else unit
