"""Other numbers in a robot file: the same file in which attributes were changed or added."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from unmodelled.base.errors import BadInput
from unmodelled.systems.robot import mjcf, urdf
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.numbers import Key, consistent, differing, numbers
from unmodelled.systems.robot.tree import RobotTree


@dataclass(frozen=True)
class Patched:
    """Patched robot file."""

    text: str
    format: str  # MJCF or URDF
    #: wanted numbers that the file does not hold, as its format or its other entries do not allow them, SI
    missing: Mapping[Key, float]


def patched(text: str, where: str, wanted: Mapping[Key, float]) -> Patched:
    """Return a robot file with other numbers, and those of them that MuJoCo then does not read of it."""
    robot = compiled(text, where)
    found, written = numbers(robot), text
    all_of_it = consistent(robot, {**found, **wanted})
    # what MuJoCo computes of a number, such as kv of dampratio and an armature, is written in a second pass
    for _ in range(2):
        changed = differing(all_of_it, found)
        if not changed:
            break
        tree = RobotTree.of(written)
        _check_names(tree, robot, where)
        (urdf if tree.urdf else mjcf).write(tree, robot, all_of_it, changed)
        written = str(tree)
        found = numbers(compiled(written, where))
    return Patched(written, "URDF" if RobotTree.of(text).urdf else "MJCF", differing(all_of_it, found))


def _check_names(tree: RobotTree, robot: Robot, where: str) -> None:
    for kind, known in (("body", robot.bodies), ("joint", robot.joints), ("actuator", robot.actuators)):
        for element in known:
            if element.name not in tree.elements[kind]:
                raise BadInput(f"{where}: {kind} {element.name!r} is not found in the file: give it a name")
