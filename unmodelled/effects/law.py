"""Law of an effect in local names, with its numbers and its memory.

Local names are x, v, a, l, s and u (position, velocity, acceleration and load of a port, stiffness of the
known spring there, and logged level of the surroundings), u and v (logged input, and speed of the port that
it drives), y and r (output without the effect, and output that shows its rate) or p (parameter), besides t
and the names that the law declares.
Texts are expressions of the grammar of system files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from unmodelled.effects.columns import Column

#: How many times its plausible size a number may reach.
REACH = 1000.0


@dataclass(frozen=True)
class Amplitude:
    """Number in which the law is linear; at zero the effect is absent.

    Attributes:
        adds: contribution of one unit at the place, as an expression.
        scale: plausible magnitude, in SI units.
        bounds: lowest and highest value, in SI units.
        share: whether the amplitude switches the effect (1 present, 0 absent); default False.
        rate: contribution of one unit to the output that shows the rate of the place's output, as an
            expression; all amplitudes of a law have one, or none; default "": none.
    """

    adds: str
    scale: float
    bounds: tuple[float, float]
    share: bool = False
    rate: str = ""


def neat(value: float) -> float:
    """Return a number rounded to three digits.

    Args:
        value: number to round.

    Returns:
        Rounded number.

    Examples:
        >>> neat(0.123456)
        0.123
    """
    return float(f"{value:.3g}")


def signed(adds: str, scale: float) -> Amplitude:
    """Return an amplitude of either sign.

    Args:
        adds: contribution of one unit at the place, as an expression.
        scale: plausible magnitude, in SI units; the bounds are 1000 times as far.

    Returns:
        Amplitude.

    Examples:
        >>> signed("x", 0.5).bounds
        (-500.0, 500.0)
    """
    return Amplitude(adds, scale, (-neat(REACH * scale), neat(REACH * scale)))


def positive(adds: str, scale: float) -> Amplitude:
    """Return an amplitude that cannot be negative for physical reasons.

    Args:
        adds: contribution of one unit at the place, as an expression.
        scale: plausible magnitude, in SI units; the upper bound is 1000 times as large.

    Returns:
        Amplitude.

    Examples:
        >>> positive("v", 0.5).bounds
        (0.0, 500.0)
    """
    return Amplitude(adds, scale, (0.0, neat(REACH * scale)))


def share(adds: str) -> Amplitude:
    """Return an amplitude that switches an effect: 1 if it is present, 0 if not.

    Args:
        adds: change of the quantity at the place if the effect is present, as an expression.

    Returns:
        Amplitude.
    """
    return Amplitude(adds, 1.0, (0.0, 1.0), share=True)


@dataclass(frozen=True)
class Shape:
    """Number in which the law is not linear.

    Attributes:
        like: expression in local names that has the same unit.
        grid: starting values, in SI units, at least one; a single one is not varied.
        bounds: lowest and highest value, in SI units.
    """

    like: str
    grid: tuple[float, ...]
    bounds: tuple[float, float]

    @property
    def scale(self) -> float:
        """Plausible magnitude in SI units, positive."""
        return abs(self.grid[len(self.grid) // 2]) or max(map(abs, self.bounds))


@dataclass(frozen=True)
class Fixed:
    """Number that is not fitted, for example one that smooths a corner.

    Attributes:
        like: expression in local names that has the same unit.
        value: value in SI units.
    """

    like: str
    value: float


@dataclass(frozen=True)
class Told:
    """Words of the trade instead of a number of a law, such as the play from stop to stop for half of it.

    Attributes:
        words: words, such as "play from stop to stop"; default "": the number itself.
        symbol: the said number in terms of {0}, the name of the law's number; default that name.
        factor: said value per value in SI units; default 1.
        unit: unit of the said value; default "": that of the number, or of the column of the signal that the
            number is a value of.
        level: whether the number is a point on the scale of that signal, such as a temperature in degC,
            and no difference; default False.
        shift: SI value that is said where the number is zero; default 0.
        whole: SI value of which the number is a part, such as the known mass; default None.
        instead: SI value of the system file that the said one stands instead of; default None.
    """

    words: str = ""
    symbol: str = "{0}"
    factor: float = 1.0
    unit: str = ""
    level: bool = False
    shift: float = 0.0
    whole: float | None = None
    instead: float | None = None


@dataclass(frozen=True)
class Wave:
    """Cosine amplitude and frequency beside a sine amplitude, told together as amplitude and phase.

    Attributes:
        cosine: name of the amplitude of the cosine.
        times: number of waves per turn, or name of the law's number that is it.
    """

    cosine: str
    times: str | float


@dataclass(frozen=True)
class Slope:
    """Slope of a fitted curve beyond an edge of the data; it follows from the fitted numbers.

    Its value is the slope of the law at the edge, or zero if the law falls there.

    Attributes:
        adds: contribution of one unit at the place, as an expression.
        edge: name of the fixed number that holds the edge.
    """

    adds: str
    edge: str


@dataclass(frozen=True)
class Memory:
    """State that the effect adds.

    Attributes:
        like: expression in local names that has the same unit.
        rate: time derivative, as an expression.
        start: value at the start of an experiment, as an expression; default zero.
    """

    like: str
    rate: str
    start: str = "0"


@dataclass(frozen=True)
class Law:
    """Law of an effect at a place: the sum of amplitudes times the contributions of one unit each.

    Attributes:
        text: law as a person writes it, with unsmoothed corners.
        amplitudes: numbers in which the law is linear, by name; a name that the system already has gets a
            suffix.
        shapes: other fitted numbers by name; default none.
        fixed: numbers that are not fitted, by name; default none.
        memory: states of the effect by name; default none.
        columns: dimensionless constants of the operating point by name, with their values; default none.
        per_experiment: whether the amplitudes differ between experiments; default False.
        fitted_along: local name of the only coordinate of a fitted curve such as a polynomial, which is
            continued linearly beyond the data (see `extrapolation`); default None: the law holds everywhere.
        slopes: slopes beyond the data by name; default none.
        robot: numbers of a robot file that hold the law: new value of a number of the joint or actuator by
            its name (see `systems.robot.numbers`), in terms of these numbers and those of the law. What an
            amplitude adds that is in no value becomes a force of the supplement; default none.
        told: words of the trade instead of numbers of the law, by name; default: the numbers.
        waves: waves over an angle by the name of the sine's amplitude, in whose place a phrase tells
            amplitude and phase; default none.
        phrase: the effect in a few words with its numbers, by their names in braces; default "": the first
            number and the name of the family.
        negative: the same where the first number is negative; default "": the phrase.
        cycle: at a sensor, length in SI units of what it shows after which its error, a function of y alone,
            comes again; inf for an error that does not. A table over a cycle, or over all logged values,
            compensates such an error; default None: it cannot be compensated by what is shown.
    """

    text: str
    amplitudes: Mapping[str, Amplitude]
    shapes: Mapping[str, Shape] = field(default_factory=dict)
    fixed: Mapping[str, Fixed] = field(default_factory=dict)
    memory: Mapping[str, Memory] = field(default_factory=dict)
    columns: Mapping[str, Column] = field(default_factory=dict)
    per_experiment: bool = False
    fitted_along: str | None = None
    slopes: Mapping[str, Slope] = field(default_factory=dict)
    robot: Mapping[str, str] = field(default_factory=dict)
    told: Mapping[str, Told] = field(default_factory=dict)
    waves: Mapping[str, Wave] = field(default_factory=dict)
    phrase: str = ""
    negative: str = ""
    cycle: float | None = None

    @property
    def rates(self) -> Law | None:
        """Law at the output that shows the rate of the place's output; None without a contribution there."""
        if not all(a.rate for a in self.amplitudes.values()):
            return None
        found = {n: replace(a, adds=a.rate, rate="") for n, a in self.amplitudes.items()}
        return replace(self, amplitudes=found)

    @property
    def terms(self) -> dict[str, Amplitude | Slope]:
        """Amplitudes and slopes by name."""
        return {**self.amplitudes, **self.slopes}

    @property
    def names(self) -> tuple[str, ...]:
        """All names that the law declares."""
        return (*self.amplitudes, *self.shapes, *self.fixed, *self.memory, *self.columns, *self.slopes)
