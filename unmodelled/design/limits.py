"""Limits of an experiment: ranges and rates of the inputs, travel and speed of the machine, duration."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput, closest
from unmodelled.logs.logs import Logs
from unmodelled.systems.document import Node, load_yaml
from unmodelled.systems.model import Constant, System

Array = NDArray[np.float64]

#: Fewest and most samples of an experiment. Thousands of experiments are simulated.
FEWEST, MOST = 20, 20_000


@dataclass(frozen=True)
class Range:
    """Range of an input or of a moving part.

    Attributes:
        low: lowest value, SI.
        high: highest value, SI.
        rate: largest change per second, SI; default inf.
    """

    low: float = -np.inf
    high: float = np.inf
    rate: float = np.inf


@dataclass(frozen=True)
class Limits:
    """Limits that an experiment must keep.

    Attributes:
        file: file of the limits, for messages.
        duration: length of the experiment, s.
        period: sampling period, s.
        inputs: range of every input, in the order of the system.
        travel: ranges of states, outputs or signals by name; they hold for every model.
        start: states at the start by name, SI; the others start at the value of the system file, or at 0.
        constants: operating point by name, SI.
        noise: standard deviation of the sensor noise by name of the output, SI; empty where it is not given.
    """

    file: Path
    duration: float
    period: float
    inputs: tuple[Range, ...]
    travel: Mapping[str, Range]
    start: Mapping[str, float]
    constants: Mapping[str, float]
    noise: Mapping[str, float]

    @property
    def samples(self) -> int:
        """Return the number of samples of the experiment."""
        return round(self.duration / self.period) + 1

    def excess(self, watched: Array) -> Array:
        """Return the largest excess of a travel limit, as a share of its width; inf where a run diverges.

        Args:
            watched: quantities whose travel is limited, shape (designs, samples, quantities), SI.

        Returns:
            Excess, shape (designs,); 0 within all limits.
        """
        found = np.where(np.isfinite(watched).all(axis=(1, 2)), 0.0, np.inf)
        for k, own in enumerate(self.travel.values()):
            x = np.nan_to_num(watched[:, :, k], nan=1e30, posinf=1e30, neginf=-1e30)
            width = own.high - own.low if np.isfinite(own.high - own.low) else 1.0
            speed = np.abs(np.diff(x, axis=1)).max(axis=1) / self.period
            beyond = np.maximum(own.low - x.min(axis=1), x.max(axis=1) - own.high) / width
            found = np.maximum(found, np.maximum(beyond, speed / own.rate - 1.0))
        return np.asarray(np.maximum(found, 0.0))


def read_limits(file: Path, system: System, logs: Logs | None = None) -> Limits:
    """Read the limits of an experiment with a machine.

    Args:
        file: YAML file with the keys `duration` (s) and `inputs` (for every input `low`, `high` and, where
            limited, `rate` per second), and as needed `travel` (for a state, output or signal `low`, `high`,
            `speed` per second), `start` (states), `operating_point` (constants), `period` (s, default that
            of the logs) and `noise` (standard deviation of outputs); all in units of the system file.
        system: system of the machine.
        logs: measured experiments, for the sampling period and the operating point; default None: the file
            must give both.

    Returns:
        The limits.

    Raises:
        BadInput: when the file cannot be read, a name is unknown, or a value cannot be kept.
    """
    root = load_yaml(file)
    found = root.fields(("duration", "inputs"), ("period", "travel", "start", "operating_point", "noise"))
    duration = _positive(found["duration"])
    if "period" not in found and logs is None:
        raise root.wrong("has no period: add the sampling period, period: ... (s)")
    period = _positive(found["period"]) if "period" in found or logs is None else logs.period
    samples = round(duration / period) + 1
    if not FEWEST <= samples <= MOST:
        raise found["duration"].wrong(
            f"{duration:g} s are {samples} samples of {period:g} s, must be {FEWEST} to {MOST}: change it, "
            "or `period`"
        )
    names = [item.name for item in system.inputs]
    inputs = _named(found["inputs"], names)
    for name in names:
        if name not in inputs:
            raise found["inputs"].wrong(
                f"the input {name} has no limits: add {name}: {{low: ..., high: ...}}"
            )
    states = [s.name for s in system.states]
    moving = [*states, *(o.name for o in system.outputs), *system.signals]
    travel = {name: _travel(node) for name, node in _given(found, "travel", moving).items()}
    start = {name: node.number() for name, node in _given(found, "start", states).items()}
    for name, value in start.items():
        if name in travel and not travel[name].low <= value <= travel[name].high:
            raise found["start"].wrong(f"{name} starts at {value:g}, outside of its travel: change one")
    noise = _given(found, "noise", [o.name for o in system.outputs])
    constants = _given(found, "operating_point", [c.name for c in system.operating_point])
    return Limits(
        *(file, duration, period),
        inputs=tuple(_input(inputs[name]) for name in names),
        travel=travel,
        start=start,
        constants={
            c.name: constants[c.name].number() if c.name in constants else _usual(c, root, logs)
            for c in system.operating_point
        },
        noise={name: _positive(node) for name, node in noise.items()},
    )


def _named(node: Node, known: Collection[str]) -> Mapping[str, Node]:
    entries = node.entries()
    for name, entry in entries.items():
        if name not in known:
            raise entry.wrong(f"there is no {name!r} in the system file{closest(name, known)}")
    return entries


def _given(found: Mapping[str, Node], key: str, known: Collection[str]) -> Mapping[str, Node]:
    return _named(found[key], known) if key in found else {}


def _positive(node: Node) -> float:
    value = node.number()
    if value <= 0.0:
        raise node.wrong(f"must be positive, got {value:g}")
    return value


def _input(node: Node) -> Range:
    entries = node.fields(("low", "high"), ("rate",))
    rate = _positive(entries["rate"]) if "rate" in entries else np.inf
    return _increasing(node, Range(entries["low"].number(), entries["high"].number(), rate))


def _travel(node: Node) -> Range:
    entries = node.fields((), ("low", "high", "speed"))
    ends = {name: entries[name].number() for name in ("low", "high") if name in entries}
    rate = _positive(entries["speed"]) if "speed" in entries else np.inf
    return _increasing(node, Range(**ends, rate=rate))


def _increasing(node: Node, found: Range) -> Range:
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
