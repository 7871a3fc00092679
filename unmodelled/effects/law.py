"""What a family says of its effect, in local names: the law, its numbers and its memory.

Local names are x, v and a (position, velocity and acceleration of a port), u (an input as it was logged), y
(what an output shows without the effect) or p (a parameter), besides t and the names that the law itself
declares. Texts are expressions of the grammar of system files.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from unmodelled.effects.columns import Column

#: How many times its plausible size a number may reach.
REACH = 1000.0


@dataclass(frozen=True)
class Amplitude:
    """A number in which the law is linear; zero means that it adds nothing.

    Attributes:
        adds: what one unit of it adds at the place.
        scale: a plausible size, SI.
        bounds: of its value, SI.
        share: it says how far the effect is there, and is 1 where it is there at all.
    """

    adds: str
    scale: float
    bounds: tuple[float, float]
    share: bool = False


def neat(value: float) -> float:
    """`value` to three digits."""
    return float(f"{value:.3g}")


def signed(adds: str, scale: float) -> Amplitude:
    """An amplitude of either sign."""
    return Amplitude(adds, scale, (-neat(REACH * scale), neat(REACH * scale)))


def positive(adds: str, scale: float) -> Amplitude:
    """An amplitude that physics does not let be negative."""
    return Amplitude(adds, scale, (0.0, neat(REACH * scale)))


def share(adds: str) -> Amplitude:
    """How far the place behaves in another way, which is there or not."""
    return Amplitude(adds, 1.0, (0.0, 1.0), share=True)


@dataclass(frozen=True)
class Shape:
    """A number in which the law is not linear.

    Attributes:
        like: an expression in local names that has its unit.
        grid: starting values, SI, at least one; a single one is a start that need not be scanned.
        bounds: of its value, SI.
    """

    like: str
    grid: tuple[float, ...]
    bounds: tuple[float, float]

    @property
    def scale(self) -> float:
        """A plausible size, SI: positive."""
        return abs(self.grid[len(self.grid) // 2]) or max(map(abs, self.bounds))


@dataclass(frozen=True)
class Fixed:
    """A number that is not fitted, such as what smooths a corner; `like` as in `Shape`."""

    like: str
    value: float


@dataclass(frozen=True)
class Slope:
    """How a law goes on beyond an edge of the data: not fitted, but following from what is fitted.

    Its value is the slope of the law at the edge, or zero where the law falls there.

    Attributes:
        adds: what one unit of it adds at the place. edge: name of the fixed number where it begins.
    """

    adds: str
    edge: str


@dataclass(frozen=True)
class Memory:
    """A state of the effect's own, zero at the start of an experiment.

    Attributes:
        like: an expression in local names that has its unit. rate: its derivative by time.
    """

    like: str
    rate: str


@dataclass(frozen=True)
class Law:
    """What acts at a place: the sum of amplitudes times what one unit of each adds.

    Attributes:
        text: the law as a person writes it, corners not smoothed.
        amplitudes, shapes, fixed, memory: by name; names that the system has already get a suffix.
        columns: constants of the operating point that it needs, without unit -> their values.
        per_experiment: the amplitudes differ from experiment to experiment.
        fitted_along: the local name of the only coordinate of a law that is a mere fit, such as a polynomial,
            and could feed in any energy beyond the data: it goes on straight there, see `extrapolation`.
        slopes: of the law beyond the data, by name.
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

    @property
    def terms(self) -> dict[str, Amplitude | Slope]:
        """The numbers that what they add is multiplied by."""
        return {**self.amplitudes, **self.slopes}

    @property
    def names(self) -> tuple[str, ...]:
        """All names that the law declares."""
        return (*self.amplitudes, *self.shapes, *self.fixed, *self.memory, *self.columns, *self.slopes)
