"""What usually makes a number of a file wrong by a factor: a unit that nobody wrote beside it."""

from __future__ import annotations

import math

from unmodelled.diagnosis.data.remark import quantity
from unmodelled.systems.model import Parameter

#: Usual mistakes by their factor, and the relative deviation up to which a factor is one of these.
MISTAKES = {
    180.0 / math.pi: "degrees instead of radians",
    2.0 * math.pi: "turns instead of radians",
    30.0 / math.pi: "1/min instead of rad/s",
    60.0: "minutes instead of seconds",
    9.80665: "kilograms instead of newtons",
    1000.0: "thousandths instead of the unit",
}
NEAR = 0.01


def usual_mistake(given: Parameter, right: float) -> str:
    """Return how a number with another right value (SI) may have come about; empty if that is unusual.

    Examples:
        >>> usual_mistake(Parameter("kp", "N m/rad", 0.349), 20.0)
        'kp = 0.349 N m/rad of the file is 57.3 times too small, as by degrees instead of radians'
        >>> usual_mistake(Parameter("kp", "N m/rad", 18.0), 20.0)
        ''
    """
    known, mistake = quantity(given.value, given.unit), mistake_of(given.value, right)
    return f"{given.name} = {known} of the file is {mistake}" if mistake else ""


def mistake_of(given: float, right: float) -> str:
    """Return by which usual factor a number is wrong, in words; empty if it is none.

    Examples:
        >>> mistake_of(22.9, 0.4)
        '57.2 times too large, as by degrees instead of radians'
    """
    ratio = right / given
    way, times = ("small", ratio) if abs(ratio) > 1.0 else ("large", 1.0 / ratio)
    for factor, mistake in MISTAKES.items():
        if abs(times / factor - 1.0) < NEAR:
            return f"{times:.3g} times too {way}, as by {mistake}"
    return ""
