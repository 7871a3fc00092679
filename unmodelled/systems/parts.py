"""Parts of a system: states, inputs, outputs, constants, parameters, ports and events."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import sympy as sp

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
