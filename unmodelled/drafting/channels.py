"""A signal of the logs in a unit, and what its values say of it beside another one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodelled.drafting.columns import Signal
from unmodelled.drafting.motion import Drive, Slope, at, drive_of, slope_of
from unmodelled.drafting.names import Role, is_command, words_of
from unmodelled.logs.readers.reader import Array
from unmodelled.systems.units import parse_logged

#: Samples of a log that are looked at.
SAMPLES = 20_000
#: Standard deviations of a position by which the distance of its set point varies at most.
NEAR = 0.5
#: Range of an angle beyond which it is in degrees.
DEGREES = 40.0
#: Units of a position and of its speed, by the factor between them.
RATIOS = {
    ("rad", "rad/s"): 1.0,
    ("deg", "deg/s"): 1.0,
    ("m", "m/s"): 1.0,
    ("mm", "mm/s"): 1.0,
    ("rad", "deg/s"): 180.0 / np.pi,
    ("deg", "rad/s"): np.pi / 180.0,
    ("rad", "rpm"): 30.0 / np.pi,
    ("deg", "rpm"): 1.0 / 6.0,
    ("mm", "m/s"): 1e-3,
    ("m", "mm/s"): 1e3,
}
_LENGTHS = frozenset(["travel", "stroke", "weg", "x"])


@dataclass(frozen=True)
class Channel:
    """A signal in a unit.

    Attributes:
        signal: signal of the logs.
        unit: its unit.
        certain: whether the file or the name gives the unit.
    """

    signal: Signal
    unit: str
    certain: bool


def slope(position: Signal, other: Signal) -> Slope:
    """Compare a column with the slope of a position.

    Args:
        position: position.
        other: column that may be its speed.
    """
    t = position.t[:SAMPLES]
    return slope_of(t, plain(position)[: len(t)], at(t, other.t, other.values))


def plain(signal: Signal) -> Array:
    """Return the values of a position, unwrapped if it jumps by a turn.

    Args:
        signal: position.

    Returns:
        Values, shape (samples,).
    """
    for turn in (2.0 * np.pi, 360.0):
        jumps = np.abs(np.diff(signal.values)) > 0.9 * turn
        if jumps.any() and np.ptp(signal.values) < 1.01 * turn:
            return np.asarray(np.unwrap(signal.values, period=turn))
    return signal.values


def follows(position: Signal, other: Signal) -> bool:
    """Return whether a column that is called a set point, but not of what, moves as the position does.

    Args:
        position: position.
        other: column that may be its set point.
    """
    if other.role is not None or not is_command(other.address):
        return False
    q, wanted = _together(position, other)
    # not how far they are apart: a servo sags under a load
    return bool(np.std(wanted - q) < NEAR * np.std(q))


def position_channel(position: Signal, velocity: Channel | None, widest: float) -> Channel:
    """Return a position in its unit.

    Args:
        position: position.
        velocity: its speed; None: unknown.
        widest: largest motion of positions like it.
    """
    return Channel(position, *_position_unit(position, velocity, widest))


def _position_unit(position: Signal, velocity: Channel | None, widest: float) -> tuple[str, bool]:
    """Unit of a position, and whether it is certain."""
    if position.unit is not None:
        return position.unit, True
    if velocity is not None:
        ratio = abs(slope(position, velocity.signal).ratio)
        for (own, other), factor in RATIOS.items():
            fits = other == velocity.unit and abs(np.log(max(ratio, 1e-9) / factor)) < 0.15
            if fits and not (own == "rad" and widest > DEGREES and not velocity.certain):
                return own, velocity.certain
    if _LENGTHS & set(words_of(position.address)):
        return "m", False
    return ("deg" if widest > DEGREES else "rad"), False


def velocity_channel(position: Signal, velocity: Signal) -> Channel:
    """Return a speed in its unit.

    Args:
        position: its position.
        velocity: speed.
    """
    ratio = abs(slope(position, velocity).ratio)
    units = [pair for pair, factor in RATIOS.items() if abs(np.log(max(ratio, 1e-9) / factor)) < 0.15]
    own = position.unit or (None if velocity.unit or not units else units[0][0])
    fitting = [v for p, v in units if own in (None, p)] or ["rad/s"]
    return Channel(velocity, velocity.unit or fitting[0], velocity.unit is not None)


def input_channel(signal: Signal) -> Channel:
    """Return an input in its unit.

    Args:
        signal: input.
    """
    unit = signal.unit or {Role.CURRENT: "A", Role.VOLTAGE: "V"}.get(signal.role or Role.OTHER, "N m")
    return Channel(signal, unit, signal.unit is not None)


def correlation(position: Signal, other: Signal) -> float:
    """Return the correlation of a column with a position.

    Args:
        position: position.
        other: column.
    """
    return float(np.corrcoef(*_together(position, other))[0, 1])


def _together(position: Signal, other: Signal) -> tuple[Array, Array]:
    """Values of two columns at the instants of the first one, shape (samples,) each."""
    t = position.t[:SAMPLES]
    return position.values[: len(t)], at(t, other.t, other.values)


def fit_of(position: Channel, drive: Channel, servo: bool) -> Drive:
    """Fit the acceleration of a position by its drive, in SI units.

    Args:
        position: position.
        drive: its drive.
        servo: whether the drive is a commanded position, whose distance from the position drives.
    """
    t = position.signal.t[:SAMPLES]
    q = _si(position.unit, plain(position.signal)[: len(t)])
    u = _si(drive.unit, at(t, drive.signal.t, drive.signal.values))
    return drive_of(t, q, u - q if servo else u)


def _si(unit: str, values: Array) -> Array:
    _, logged = parse_logged(unit)
    return values if logged is None else logged.to_si(values)
