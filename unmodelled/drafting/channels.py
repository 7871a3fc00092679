"""A signal of the logs in a unit, and what its values say of it beside another one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.lines import one_line
from unmodelled.drafting.motion import Drive, Slope, at, drive_of, slope_of
from unmodelled.drafting.names import Role, is_command, says_little, words_of
from unmodelled.drafting.units import dimension_of, is_angle, is_position, is_speed
from unmodelled.systems.units import parse_logged

#: Samples of a log that are looked at.
SAMPLES = 20_000
#: Standard deviations of a position by which the distance of its set point varies at most.
NEAR = 0.5
#: Range of an angle beyond which it is in degrees.
DEGREES = 40.0
#: Units of a position and of its speed that a column without a unit may have, the usual ones first.
PAIRS = (
    ("rad", "rad/s"),
    ("deg", "deg/s"),
    ("m", "m/s"),
    ("mm", "mm/s"),
    ("rad", "deg/s"),
    ("deg", "rad/s"),
    ("rad", "rpm"),
    ("deg", "rpm"),
    ("mm", "m/s"),
    ("m", "mm/s"),
)
#: Sizes of the last digit of an angle that is logged as a whole number, in degrees, and the logarithm of a
#: factor by which its slope may miss: a resolution is exact, and an encoder has 4096 counts a turn.
DIGITS, EXACT = (0.1, 0.01, 0.001), 0.03
#: Logarithm of a factor by which such a pair may miss.
CLOSE = 0.15
#: Counts of an encoder, per turn and per metre, until somebody tells; range of whole numbers that are counts.
COUNTS, FINE, MANY = 4096, 1_000_000, 1000.0
#: Largest pressure without a unit that is in bar.
BARS = 2000.0
#: Units of inputs without one.
USUAL = {Role.CURRENT: "A", Role.VOLTAGE: "V", Role.DUTY: "1", Role.PRESSURE: "Pa", Role.FLOW: "m^3/s"}
USUAL |= {Role.POWER: "W"}
#: Words of lengths, and of angles that stay angles where a force drives them, as the pole on a cart.
_LENGTHS = frozenset(["travel", "stroke", "weg", "hub", "x", "y", "z"])
_TURNING = frozenset(["theta", "angle", "phi", "winkel", "pitch", "roll", "yaw", "tilt", "azimuth"])


@dataclass(frozen=True)
class Channel:
    """A signal in a unit."""

    signal: Signal
    unit: str  # of the scaled values
    certain: bool  # file or name give the unit
    scale: float = 1.0  # factor of the logged values
    question: str = ""  # on the scale; "": none but that on the unit, if it is not certain

    def si(self, values: Array) -> Array:
        """Convert logged values (samples,) to SI units."""
        _, logged = parse_logged(self.unit)
        return self.scale * values if logged is None else logged.to_si(self.scale * values)

    @property
    def size(self) -> float:
        """One logged unit in SI units."""
        one, zero = self.si(np.array([1.0, 0.0]))
        return float(one - zero)


def slope(position: Signal, other: Signal) -> Slope:
    """Compare a column with the slope of a position."""
    t = position.t[:SAMPLES]
    return slope_of(t, plain(position)[: len(t)], at(t, other.t, other.values))


def plain(signal: Signal) -> Array:
    """Return the values (samples,) of a position, unwrapped if it jumps by a turn."""
    for turn in (2.0 * np.pi, 360.0):
        jumps = np.abs(np.diff(signal.values)) > 0.9 * turn
        if jumps.any() and np.ptp(signal.values) < 1.01 * turn:
            return np.asarray(np.unwrap(signal.values, period=turn))
    return signal.values


def followed(position: Channel, other: Signal) -> Channel | None:
    """Return a set point that a name does not tell of what, in the unit in which a position follows it."""
    if other.role is not None or not is_command(other.address):
        return None
    asked = "is its scale that of the position?" if position.question else ""
    alike = [own for own, _ in PAIRS[:4] if is_angle(own) == is_angle(position.unit)]
    tried = [
        Channel(other, position.unit, False, position.scale, asked),
        *(Channel(other, unit, False) for unit in alike),
    ]
    q, wanted = _together(position.signal, other)
    moved = position.si(q)
    # not how far they are apart: a servo sags under a load
    return next((each for each in tried if np.std(each.si(wanted) - moved) < NEAR * np.std(moved)), None)


def position_channel(
    position: Signal, velocity: Signal | None, widest: float, pushed: bool = False
) -> Channel:
    """Return a position in its unit."""
    given, whole = position.unit, bool(np.all(position.values == np.round(position.values)))
    if given is not None and is_position(given):
        return Channel(position, given, True)
    words = {*words_of(position.address)}
    linear = bool(words & _LENGTHS) or (pushed and not words & _TURNING)
    own = None if velocity is None else _by_speed(position, velocity, widest, linear)
    digit = _digit(position, velocity) if given is own is None and whole and velocity is not None else None
    if velocity is not None and digit is not None:
        asked = f"is one {digit:g} deg? It is by {one_line(velocity.address)}."
        return Channel(position, "deg", False, digit, asked)
    if given is not None or (whole and widest > MANY):
        return _scaled(position, velocity, linear)
    if velocity is not None and own is not None:
        return Channel(position, own, velocity.unit is not None)
    if linear:
        return Channel(position, "m", False)
    return Channel(position, "deg" if widest > DEGREES else "rad", False)


def is_slope(position: Signal, other: Signal, correlated: float) -> bool:
    """Return whether a column of little name is the slope of a position, in a usual pair of units."""
    if other.unit is not None or not says_little(other.address) or is_command(other.address):
        return False
    found = slope(position, other)
    pairs = [pair for pair in PAIRS if position.unit in (None, pair[0])]
    usual = any(_close(found.ratio, _size(own) / _size(rate), EXACT) for own, rate in pairs)
    return found.correlation >= correlated and usual


def _by_speed(position: Signal, velocity: Signal, widest: float, linear: bool) -> str | None:
    """Unit of a position whose slope a speed is; None if no usual pair of units fits."""
    rate, known = abs(slope(position, velocity).ratio), velocity.unit is not None
    pairs = [(own, other) for own, other in PAIRS if velocity.unit in (None, other)]
    pairs = pairs if known or not linear else [pair for pair in pairs if not is_angle(pair[0])]
    fitting = [own for own, other in pairs if _close(rate, _size(own) / _size(other))]
    return next((own for own in fitting if known or own != "rad" or widest <= DEGREES), None)


def _digit(position: Signal, velocity: Signal) -> float | None:
    """Size of the last digit of an angle, in degrees, if a speed in degrees or radians tells it."""
    rate = abs(slope(position, velocity).ratio)
    speeds = [other for own, other in PAIRS if own == "deg" and velocity.unit in (None, other)]
    sizes = ((digit, other) for other in speeds for digit in DIGITS)
    return next((d for d, other in sizes if _close(rate, d * _size("deg") / _size(other), EXACT)), None)


def _size(unit: str) -> float:
    _, logged = parse_logged(unit)
    return 1.0 if logged is None else logged.factor


def _close(value: float, wanted: float, most: float = CLOSE) -> bool:
    return bool(abs(np.log(max(value, 1e-12) / wanted)) < most)


def _scaled(position: Signal, velocity: Signal | None, linear: bool) -> Channel:
    """A position in counts, or in the unit of a sensor: its scale follows from a speed, or is asked."""
    scale, by = 0.0, "a guess"
    if velocity is not None and velocity.unit is not None and is_speed(velocity.unit):
        linear = dimension_of(velocity.unit) == dimension_of("m/s")
        scale = abs(slope(position, velocity).ratio) * _size(velocity.unit)
        by = f"by {one_line(velocity.address)}"
    if position.unit in (None, "count"):
        unit, whole, usual = ("m", "metre", FINE) if linear else ("turn", "turn", COUNTS)
        counts = _size(unit) / scale if scale else usual
        asked = f"how many counts a {whole}? {counts:.0f} is {by}."
        return Channel(position, unit, False, 1.0 / counts, asked)
    unit = "m" if linear else "rad"
    asked = f"which {unit} is one {position.unit}? {scale or 1.0:.4g} is {by}."
    return Channel(position, unit, False, scale or 1.0, asked)


def velocity_channel(position: Channel, velocity: Signal) -> Channel:
    """Return a speed in its unit."""
    if velocity.unit is not None and is_speed(velocity.unit):
        return Channel(velocity, velocity.unit, True)
    kind = "rad" if is_angle(position.unit) else "m"
    ratio = abs(slope(position.signal, velocity).ratio) / position.size
    if velocity.unit is None and (not position.question or position.scale in DIGITS):
        alike = (other for own, other in PAIRS if is_angle(own) == is_angle(kind))
        fitting = (other for other in alike if _close(ratio, _size(kind) / _size(other)))
        return Channel(velocity, next(fitting, f"{kind}/s"), False)
    asked = f"the scale is that of {one_line(position.signal.address)}: is it right?"
    return Channel(velocity, f"{kind}/s", False, 1.0 / ratio, asked)


def input_channel(signal: Signal, angular: bool) -> Channel:
    """Return an input in its unit."""
    effort = "N m" if angular else "N"
    unit = signal.unit or USUAL.get(signal.role or Role.OTHER, effort)
    if signal.unit is None and signal.role is Role.PRESSURE and np.abs(signal.values).max() < BARS:
        unit = "bar"
    return Channel(signal, "1" if unit == "count" else unit, signal.unit is not None)


def correlation(position: Signal, other: Signal) -> float:
    """Return the correlation of a column with a position."""
    return float(np.corrcoef(*_together(position, other))[0, 1])


def _together(position: Signal, other: Signal) -> tuple[Array, Array]:
    """Values of two columns at the instants of the first one, shape (samples,) each."""
    t = position.t[:SAMPLES]
    return position.values[: len(t)], at(t, other.t, other.values)


def fit_of(position: Channel, drive: Channel, servo: bool, against: Channel | None = None) -> Drive:
    """Fit the acceleration of a position by its drive, in SI units."""
    t = position.signal.t[:SAMPLES]
    q = position.si(plain(position.signal)[: len(t)])
    u = drive.si(at(t, drive.signal.t, drive.signal.values))
    if against is not None:
        u = u - against.si(at(t, against.signal.t, against.signal.values))
    return drive_of(t, q, u - q if servo else u)
