"""Joints of a robot that stand still in a system, and what a system file says of them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from unmodelled.base.errors import closest, first_few
from unmodelled.systems.document import Node
from unmodelled.systems.robot.actuators import Drives
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.links import Tree
from unmodelled.systems.robot.numbers import OF_JOINTS
from unmodelled.systems.syntax import shown

#: Keys of a system file that belong to its robot.
KEYS = ("model", "locked", "identify")
#: What is wrong with a robot that stands still.
STILL = "no joint moves a mass, so that nothing moves: give a link a mass and an inertia"


def standing(sections: Mapping[str, Node], robot: Robot) -> tuple[dict[int, float], list[str]]:
    """Return the coordinate (rad or m) of every joint that does not move, by number, and notes on them."""
    locked, notes = _locked(sections, robot), list[str]()
    if apart := _apart(sections, robot, locked):
        words = "are in no input and no output: with the joints that follow them, they stand still at 0; "
        still = first_few([robot.joints[k].written for k in apart])
        notes.append(f"{still} {words}to let them move, add their inputs and outputs")
    return robot.resting({**locked, **dict.fromkeys(apart, 0.0)}), notes


def without_standing(
    sections: Mapping[str, Node], robot: Robot, resting: Iterable[int]
) -> tuple[dict[str, Node], list[str]]:
    """Return the sections without entries of joints that stand still, and a note on these.

    An entry that says all that an entry needs, such as another input of the same name, stays.
    """
    joints = {k: robot.joints[k].name for k in resting}
    inputs = {f"tau_{name}" for name in joints.values()}
    inputs |= {f"u_{actuator.name}" for actuator in robot.actuators if actuator.joint in joints}
    outputs = {f"{state}_{name}" for state in ("q", "qd") for name in joints.values()}
    numbers = {f"{name}_{quantity}" for quantity in OF_JOINTS for name in joints.values()}
    own = {"inputs": (inputs, "unit"), "outputs": (outputs, "expression"), "parameters": (numbers, "unit")}
    own |= {"ports": ({*joints.values()}, "effort")}
    found, idle = dict(sections), list[str]()
    for section, (names, needed) in own.items():
        node = sections.get(section)
        entries = node.entries() if node is not None else {}
        left_out = [name for name, entry in entries.items() if name in names and needed not in _keys(entry)]
        if node is not None and left_out:
            kept = {name: entry for name, entry in entries.items() if name not in left_out}
            found[section] = replace(node, content=kept)
            idle += [f"{section}.{name}" for name in left_out]
    words = "not used, because its joint stands still"
    return found, [f"{first_few(idle)}: {words}"] if idle else []


def _keys(entry: Node) -> Iterable[str]:
    return entry.content if isinstance(entry.content, dict) else ()


def _locked(sections: Mapping[str, Node], robot: Robot) -> dict[int, float]:
    found, node = dict[int, float](), sections.get("locked")
    names = {name: k for k, joint in enumerate(robot.joints) for name in (joint.name, joint.written)}
    for name, value in node.entries().items() if node is not None else ():
        if name not in names:
            raise value.wrong(f"the robot has no joint {shown(name)}{closest(name, names)}")
        found[names[name]] = value.number()
    if len(robot.resting(found)) == len(robot.joints):
        if node is not None:
            raise node.wrong("all joints are locked, so that nothing moves: leave one of them out")
        raise sections["model"].wrong(STILL)
    return found


def _apart(sections: Mapping[str, Node], robot: Robot, locked: Mapping[int, float]) -> list[int]:
    """Driven joints at the tips, such as fingers, that a file which names its inputs does not name.

    A joint without an actuator in a robot that has others, such as a pendulum, moves by itself. So does a
    joint that is an output because the file names no outputs, but for one that others follow.
    """
    if not ("inputs" in sections and sections["inputs"].entries()):
        return []
    said = {word for key, node in sections.items() if key not in KEYS for word in _texts(node)}
    tree = Tree.of(robot, robot.resting(locked))
    drives = Drives(robot, tree, lambda element, quantity, value: repr(value)).used
    asked, names = "outputs" in sections and bool(sections["outputs"].entries()), dict[int, str]()
    for k in tree.leaders:
        inputs = drives[f"drive_{robot.joints[k].name}"]
        if inputs and (asked or tree.followers[k]):
            names[k] = "|".join([rf"(\w+_)?{robot.joints[k].name}", *inputs])
    moving = {k for k in tree.leaders if k not in names}
    moving |= {k for k, name in names.items() if any(re.search(rf"\b({name})\b", text) for text in said)}
    for link in reversed(tree.links):  # what carries a moving link is no tip
        if link.leader in moving and link.parent >= 0:
            moving.add(tree.links[link.parent].leader)
    return [k for k in tree.leaders if k not in moving]


def _texts(node: Node) -> Iterator[str]:
    """Names and texts of a part of the system file."""
    if isinstance(node.content, str):
        yield node.content
    elif isinstance(node.content, dict):
        yield from node.content
    parts = node.content.values() if isinstance(node.content, dict) else node.content or ()
    for part in parts if not isinstance(node.content, str) else ():
        assert isinstance(part, Node)
        yield from _texts(part)
