"""Limits of an experiment: ranges and rates of the inputs, travel and speed of the machine, duration."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput, closest
from unmodelled.logs.cells import LARGEST
from unmodelled.logs.logs import Logs, as_logged
from unmodelled.systems.document import Node, load_yaml
from unmodelled.systems.model import Constant, System, symbol
from unmodelled.systems.units import LoggedUnit

#: Fewest and most samples of an experiment. Thousands of experiments are simulated.
FEWEST, MOST = 20, 20_000
#: Share of a travel limit that an experiment leaves free, because models err.
MARGIN = 0.05
#: Of the range of the logs: limits that reach farther beyond it may be in another unit.
FAR = 10.0
SECONDS = LoggedUnit("s", 1.0, 0.0)


@dataclass(frozen=True)
class Range:
    """Range of an input or of a moving part."""

    low: float = -np.inf
    high: float = np.inf
    rate: float = np.inf  # largest change per second
    rest: float = 0.0  # value closest to the zero of the unit in which the range was written

    @property
    def level(self) -> float:
        """Return the value closest to zero, at which an input rests."""
        return min(max(self.low, 0.0), self.high)

    def in_si(self, unit: LoggedUnit) -> Range:
        """Return the range in SI units."""
        ends = unit.to_si(np.array([self.low, self.high, self.level]))
        low, high, rest = ends.tolist()
        return Range(low, high, self.rate * unit.factor, rest)


@dataclass(frozen=True)
class Limits:
    """Limits that an experiment must keep."""

    file: Path
    duration: float  # s
    period: float  # s
    inputs: tuple[Range, ...]  # in the order of the system, SI
    written: tuple[Range, ...]  # the same in the units of the columns
    travel: Mapping[str, Range]  # of states, outputs or signals, SI; they hold for every model
    start: Mapping[str, float]  # states, SI; others start at the value of the system file, or at 0
    constants: Mapping[str, float]  # SI
    noise: Mapping[str, float]  # standard deviation of the sensor by output, SI; empty where it is not given
    #: Of outputs by name, as the file writes them: what `travel` and `start` of this name say.
    shown: Mapping[str, sp.Expr] = field(default_factory=dict)
    moves: Mapping[str, Range] = field(default_factory=dict)  # `travel` in the units in which it is written
    clock: str = "s"  # unit of the clock of the experiment as it is written: that of the logs

    @property
    def samples(self) -> int:
        """Return the number of samples of the experiment."""
        return round(self.duration / self.period) + 1

    @property
    def c(self) -> Array:
        """Return the operating point (constants,), SI, in the order of the system."""
        return np.array([*self.constants.values()])

    @cached_property
    def start_states(self) -> Mapping[str, sp.Expr]:
        """Return the states of `start`, SI, in terms of parameters, constants and inputs."""
        found = {}
        for name, value in self.start.items():
            x = symbol(name)
            shown = self.shown.get(name, x)
            found[name] = (value - shown.xreplace({x: sp.S.Zero})) / sp.diff(shown, x)
        return found

    def excess(self, watched: Array, step: float, margin: float = 0.0) -> Array:
        """Return the largest excess (designs,) of a travel limit as a share of its width; inf: diverges.

        Takes watched (designs, times, quantities), SI, see `runs.quantities`, the step from one time to the
        next, s, and margin, the share of the width that stays free at each end, but for the way from a start
        that lies there.
        """
        found = np.where(np.isfinite(watched).all(axis=(1, 2)), 0.0, np.inf)
        for name, column in self.columns(watched):
            own = self.travel[name]
            x = np.nan_to_num(column, nan=1e30, posinf=1e30, neginf=-1e30)
            start = x[:, 0]
            width = np.full(len(x), own.high - own.low)
            if not np.isfinite(width).all():  # a limit on one side alone is as wide as the way to it
                ways = [np.abs(end - start) for end in (own.low, own.high) if np.isfinite(end)]
                width = np.where(ways[0] > 0.0, ways[0], 1.0) if ways else np.ones(len(x))
            low = np.minimum(own.low + margin * width, np.maximum(start, own.low))
            high = np.maximum(own.high - margin * width, np.minimum(start, own.high))
            speed = np.abs(np.diff(x, axis=1)).max(axis=1) / step
            beyond = np.maximum(low - x.min(axis=1), x.max(axis=1) - high) / width
            found = np.maximum(found, np.maximum(beyond, speed / (own.rate * (1.0 - margin)) - 1.0))
        return np.asarray(np.maximum(found, 0.0))

    def columns(self, watched: Array) -> Iterator[tuple[str, Array]]:
        """Yield the name of a travel limit with the quantity (..., samples) of every column it holds for."""
        names = [*self.travel]
        for k in range(watched.shape[-1]):
            yield names[k % len(names)], watched[..., k]


def read_limits(file: Path, system: System, logs: Logs | None = None) -> Limits:
    """Read the limits of an experiment with a machine, in the units of its system file.

    An input, an output and a constant have the unit of their column (mA, degC, %), and rates that unit per
    second; a state that no output of the same name shows has its SI unit, and so has a signal. A name that
    an output and a state share is the output, as its expression in the file says.
    """
    root = load_yaml(file, "limits")
    found = root.fields(("duration", "inputs"), ("period", "travel", "start", "operating_point", "noise"))
    duration, period = _times(root, found, logs)
    items = {item.name: item.as_written for item in system.inputs}
    inputs = _named(found["inputs"], items)
    for name, unit in items.items():
        if name not in inputs:
            raise found["inputs"].wrong(
                f"the input {name} has no limits: add {name}: {{low: ..., high: ...}}{_in(unit)}"
            )
    written = tuple(_range(inputs[name], unit, ("low", "high"), "rate") for name, unit in items.items())
    units = units_of(system)
    moving = _given(found, "travel", units)
    travel = {name: _range(node, units[name], (), "speed") for name, node in moving.items()}
    noise = _given(found, "noise", [o.name for o in system.outputs])
    constants = _given(found, "operating_point", [c.name for c in system.operating_point])
    limits = Limits(
        *(file, duration, period),
        inputs=tuple(own.in_si(unit) for own, unit in zip(written, items.values(), strict=True)),
        written=written,
        travel={name: own.in_si(units[name]) for name, own in travel.items()},
        start=_start(root, found, system, logs, travel),
        constants={
            c.name: _si(constants[c.name], c.as_written) if c.name in constants else _usual(c, root, logs)
            for c in system.operating_point
        },
        noise={
            name: _positive(node, units[name].of_differences) * units[name].factor
            for name, node in noise.items()
        },
        shown={output.name: output.expression for output in system.outputs},
        moves=travel,
        clock="s" if logs is None else logs.clock,
    )
    _check_start(root, found, system, limits)
    return limits


def far_from_logs(limits: Limits, system: System, logs: Logs) -> list[str]:
    """Return a remark for every input whose limits reach far beyond what was logged, as in a wrong unit."""
    found = []
    for k, (item, own) in enumerate(zip(system.inputs, limits.written, strict=True)):
        u = as_logged(item, logs.u[:, k])
        low, high, width = float(u.min()), float(u.max()), float(np.ptp(u))
        if width and max(own.high - high, low - own.low) > FAR * width:
            ranges = f"{own.low:g} to {own.high:g} {item.column_unit}, the logs have {low:.4g} to {high:.4g}"
            found.append(
                f"the limits of {item.name} are {ranges}: check their unit, it is that of the column"
            )
    return found


def units_of(system: System) -> dict[str, LoggedUnit]:
    """Return the units in which limits of states, signals and outputs are written, by name.

    An output has the unit of its column, also where a state has its name; other states have their SI unit.
    """
    own = {state.name: LoggedUnit(state.unit, 1.0, 0.0) for state in system.states}
    signals = {name: LoggedUnit("", 1.0, 0.0) for name in system.signals}
    return own | signals | {output.name: output.as_written for output in system.outputs}


def _times(root: Node, found: Mapping[str, Node], logs: Logs | None) -> tuple[float, float]:
    duration = _positive(found["duration"])
    if "period" not in found and logs is None:
        raise root.wrong("has no period: add the sampling period, period: ... (s)")
    period = _positive(found["period"]) if "period" in found or logs is None else logs.period
    if not FEWEST <= duration / period + 1.0 <= MOST:
        raise found["duration"].wrong(
            f"{duration:g} s are {duration / period + 1.0:.6g} samples of {period:g} s, must be {FEWEST} to "
            f"{MOST}: change it, or `period`"
        )
    return duration, period


def _start(
    root: Node, found: Mapping[str, Node], system: System, logs: Logs | None, travel: Mapping[str, Range]
) -> dict[str, float]:
    """States at the start, SI. Zero is no rest on a scale such as degC: there a start is needed, which is
    the mean of the logged ones where there are logs.
    """
    units = {state.name: units_of(system)[state.name] for state in system.states}
    given = _given(found, "start", units)
    for name, node in given.items():
        value, own = node.number(), travel.get(name, Range())
        if not own.low <= value <= own.high:
            text = units[name].text
            raise node.wrong(f"{name} starts at {value:g} {text}, outside of its travel: change one")
    start = {name: _si(node, units[name]) for name, node in given.items()}
    for name, unit in units.items():
        if name not in start and unit.offset:
            if logs is None:
                raise root.wrong(f"start: {name} has no start: add start: {{{name}: ...}}{_in(unit)}")
            start[name] = float(logs.y[logs.offsets[:-1], logs.outputs.index(name)].mean())
    return start


def _check_start(root: Node, found: Mapping[str, Node], system: System, limits: Limits) -> None:
    """Refuse outputs from which the states of their names do not follow."""
    for name in limits.start:
        shown = limits.shown.get(name, symbol(name))
        slope = sp.diff(shown, symbol(name)).xreplace(dict(zip(system.p, system.values, strict=True)))
        if slope == 0 or (slope.free_symbols | shown.free_symbols - {symbol(name)}) & {*system.x}:
            raise found.get("start", root).wrong(
                f"{name}: the output {name} shows {shown}, from which the start of the state {name} does not "
                "follow: give the output another name in the system file"
            )


def _named(node: Node, known: Collection[str]) -> Mapping[str, Node]:
    entries = node.entries()
    for name, entry in entries.items():
        if name not in known:
            raise entry.wrong(f"there is no {name!r} in the system file{closest(name, known)}")
    return entries


def _given(found: Mapping[str, Node], key: str, known: Collection[str]) -> Mapping[str, Node]:
    return _named(found[key], known) if key in found else {}


def _in(unit: LoggedUnit) -> str:
    return f" ({unit.text})" if unit.text not in ("", "-") else ""


def _si(node: Node, unit: LoggedUnit) -> float:
    """A value in SI units."""
    return float(unit.to_si(np.asarray(_checked(node, unit))))


def _checked(node: Node, unit: LoggedUnit = SECONDS) -> float:
    """A value in `unit`, which is no larger than a measurement can be."""
    value = node.number()
    if abs(value) * max(unit.factor, 1.0) > LARGEST:
        raise node.wrong(f"{value:g} {unit.text} is beyond any measurement: change it")
    return value


def _positive(node: Node, unit: LoggedUnit = SECONDS) -> float:
    value = _checked(node, unit)
    if not value * min(unit.factor, 1.0) > 1.0 / LARGEST:
        raise node.wrong(f"must be positive, got {value:g}")
    return value


def _range(node: Node, unit: LoggedUnit, needed: tuple[str, ...], rate: str) -> Range:
    """Ends in `unit`, and the largest change per second, which the file calls `rate`."""
    entries = node.fields(needed, tuple(name for name in ("low", "high", rate) if name not in needed))
    ends = {name: _checked(entries[name], unit) for name in ("low", "high") if name in entries}
    found = Range(**ends, rate=_positive(entries[rate], unit) if rate in entries else np.inf)
    if not found.low < found.high:
        raise node.wrong(f"low must be below high, got {found.low:g} and {found.high:g}")
    return found


def _usual(constant: Constant, root: Node, logs: Logs | None) -> float:
    """The value of all experiments, or the default of the system file."""
    values = np.empty(0) if logs is None else logs.c[:, logs.constants.index(constant.name)]
    if len(values) and np.all(values == values[0]):
        return float(values[0])
    if constant.other is not None:
        return constant.other
    why = "has no value" if logs is None else "differs between the logs"
    raise BadInput(
        f"{root.file}: operating_point: {constant.name} {why}: add operating_point: {{{constant.name}: ...}}"
    )
