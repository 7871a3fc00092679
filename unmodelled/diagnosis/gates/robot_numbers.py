"""Numbers that no robot has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite

import numpy as np

from unmodelled.diagnosis.data.remark import quantity
from unmodelled.systems.model import System
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.efforts import Efforts
from unmodelled.systems.robot.numbers import (
    OF_BODIES,
    PAIRS,
    Key,
    differing,
    numbers,
    properties,
    unit_of,
    whole_links,
)

#: Quantities that are never negative.
_NEVER_NEGATIVE = ("mass", "armature", "damping", "frictionloss", "timeconst", "kv")
#: Quantities that turn a drive over or off where they change their sign or vanish.
_GAINS = ("gear", "gain", "kp")
#: Part of a given gain that a changed one keeps at least; effects stop there, too.
LEAST_GAIN = 0.05
#: Share of the largest principal inertia that rounding may take from the sum of the others.
_ROUNDING = 1e-6


def impossible_robot(robot: Robot, wanted: Mapping[Key, float]) -> str:
    """Return what is impossible about the changed numbers of a robot."""
    given = numbers(robot)
    changed = differing(wanted, {key: given[key] for key in wanted})
    return next(_faults(robot, given, wanted, changed), "")


def impossible_parameters(system: System) -> str:
    """Return what is impossible about the parameters of a system that are numbers of its robot file."""
    if system.robot is None:
        return ""
    efforts = Efforts(system, compiled(system.robot.text, system.robot.file))
    values = {p.name: p.value for p in system.parameters}
    return impossible_robot(efforts.robot, of_parameters(efforts, values))


def of_parameters(efforts: Efforts, values: Mapping[str, float]) -> dict[Key, float]:
    """Return all numbers of a robot, with the values (SI) of the parameters that stand for some of them."""
    known = {p.name: (p.element, p.quantity) for p in properties(efforts.robot, efforts.tree)}
    changed = {known[name]: value for name, value in values.items() if name in known}
    return {**numbers(efforts.robot), **whole_links(efforts.robot, changed)}


def _faults(
    robot: Robot, given: Mapping[Key, float], wanted: Mapping[Key, float], changed: Mapping[Key, float]
) -> Iterator[str]:
    for key, value in changed.items():
        element, name = key
        said = f"{element}.{name} would be {quantity(value, unit_of(robot, key))}"
        if np.isnan(value) or (not isfinite(value) and isfinite(given[key])):
            yield f"{element}.{name} would have no value"
        elif name in _NEVER_NEGATIVE and value < 0.0 <= given[key]:
            yield f"{said}, which is never negative"
        elif name in _GAINS and given[key] and value / given[key] <= LEAST_GAIN:
            yield f"{said} instead of {given[key]:.3g}, which switches the drive off or turns it over"
        elif name.endswith("_low") and value >= wanted[element, high := name.replace("_low", "_high")]:
            yield f"{said}, not below {high}"
        elif name.endswith("_high") and value <= wanted[element, low := name.replace("_high", "_low")]:
            yield f"{said}, not above {low}"
    for element in dict.fromkeys(e for e, name in changed if name in OF_BODIES):
        yield from _inertia(element, wanted)


def _inertia(body: str, wanted: Mapping[Key, float]) -> Iterator[str]:
    values = [wanted[body, name] for name in OF_BODIES if name.startswith("inertia_")]
    matrix = np.zeros((3, 3))
    for (i, j), value in zip(PAIRS, values, strict=True):
        matrix[i, j] = matrix[j, i] = value
    a, b, c = np.linalg.eigvalsh(matrix).tolist() if np.isfinite(matrix).all() else (0.0, 0.0, 1.0)
    if a < -_ROUNDING * abs(c) or a + b < c * (1.0 - _ROUNDING):
        yield (
            f"the principal inertias of {body} would be {a:.3g}, {b:.3g} and {c:.3g} kg m^2, and the sum of "
            "two is at least the third"
        )
