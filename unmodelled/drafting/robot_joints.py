"""Joints of a robot file and the columns of logs that show them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from unmodelled.base.errors import BadInput, first_few
from unmodelled.drafting.channels import Channel
from unmodelled.drafting.draft import Draft
from unmodelled.drafting.joints import Joint
from unmodelled.drafting.lines import numbered, one_line
from unmodelled.systems.robot.bodies import Robot

#: Number and signals of a joint of the logs.
Shown = tuple[str, Joint]


@dataclass(frozen=True)
class Matched:
    """Joints of a robot file beside the positions of logs."""

    driven: dict[str, Shown]  # joints that move by themselves, in the order of the robot
    following: dict[str, Shown]  # joints that follow another one
    unused: tuple[str, ...]  # joints that move no mass, though they move in the logs
    resting: dict[str, Channel]  # positions that do not change, by joint
    by_name: bool


def matched(draft: Draft, robot: Robot, moving: Sequence[str], where: Path) -> Matched:
    """Return the joints of a robot that the logs show: by their names, else in their order."""
    found = list(numbered(draft.joints))
    positions = {one[1].position.signal.address: one for one in found}
    every = [joint.name for joint in robot.joints]
    columns = [channel.signal.address for channel in draft.positions]
    own = _named(every, [*positions])
    by_name = len(own) == len(found)
    other = _named(every, columns) if by_name else _in_order(robot, moving, [*positions], columns, where)
    own = {**other, **own} if by_name else other
    shown = {joint: positions[address] for joint, address in own.items() if address in positions}
    channels = {channel.signal.address: channel for channel in draft.positions}
    following = {robot.joints[k].name for k in robot.following({})}
    return Matched(
        {joint: shown[joint] for joint in moving if joint in shown},
        {joint: one for joint, one in shown.items() if joint in following},
        tuple(joint for joint in shown if joint not in following and joint not in moving),
        {joint: channels[own[joint]] for joint in own.keys() - shown.keys()},
        by_name,
    )


def locked_lines(found: Matched, joints: Sequence[str]) -> list[str]:
    """Return lines of the system file for the joints that do not move in the logs."""
    lines = []
    for joint in (each for each in joints if each not in found.driven):
        channel = found.resting.get(joint)
        if channel is None:
            said = "Question: no column shows this joint. Where does it stand?"
            lines.append(f"  {joint}: 0  # {said}")
        else:
            value = float(np.mean(channel.si(channel.signal.values)))
            said = f"{one_line(channel.signal.address)}, which does not move."
            asked = "" if channel.certain else f" Question: is it in {channel.unit}?"
            lines.append(f"  {joint}: {value:.6g}  # {said}{asked}")
    return ["locked:", *lines] if lines else []


def _named(joints: Sequence[str], addresses: Sequence[str]) -> dict[str, str]:
    """Column by the joint whose name is the longest in the name of the column."""
    named: dict[str, str] = {}
    for address in addresses:
        if inside := [joint for joint in joints if joint in address]:
            named.setdefault(max(inside, key=len), address)
    return named


def _in_order(
    robot: Robot, moving: Sequence[str], found: Sequence[str], columns: Sequence[str], where: Path
) -> dict[str, str]:
    """Column by joint where the names do not tell, as many joints as columns.

    Of an arm with a tool, such as a gripper, that is not logged, the first joints are those of the logs.
    """
    every = [joint.name for joint in robot.joints]
    independent = [joint.name for joint in robot.joints if joint.follows is None]
    for addresses in (found, columns):
        for names in (every, independent, moving):
            if len(names) == len(addresses):
                return dict(zip(names, addresses, strict=True))
    count = len(found)
    if 0 < count < len(moving) and {*moving[count:]} <= _beyond(robot, moving[count - 1]):
        return dict(zip(moving, found, strict=False))
    raise BadInput(
        f"{where}: has {len(moving)} joints ({first_few(moving)}), and {count} positions of the logs "
        f"move ({first_few(found)}): name the columns like the joints, or write the system file by hand"
    )


def _beyond(robot: Robot, joint: str) -> set[str]:
    """Joints of the links that a joint carries."""
    carried, found = list[bool](), set[str]()
    for body in robot.bodies:
        names = [robot.joints[k].name for k in body.joints]
        inside = body.parent >= 0 and carried[body.parent]
        found |= {name for n, name in enumerate(names) if inside or joint in names[:n]}
        carried.append(inside or joint in names)
    return found
