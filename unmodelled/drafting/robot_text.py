"""The text of a system file whose known physics is a robot file, for the columns of logs."""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import replace
from pathlib import Path

from unmodelled.base.errors import BadInput, first_few
from unmodelled.drafting.channels import Channel
from unmodelled.drafting.draft import Draft
from unmodelled.drafting.joints import Joint, with_goal
from unmodelled.drafting.lines import one_line, quoted, word
from unmodelled.drafting.robot_joints import locked_lines, matched
from unmodelled.drafting.units import si_unit
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.files import robot_text
from unmodelled.systems.robot.sections import moving
from unmodelled.systems.robot.standing import STILL

#: Bounds of the torque constant of a drive, N m/A.
CONSTANTS = 0.001, 1000.0
#: Factor between the gain of a servo and that of the robot file, either way, that it is searched within.
GAINS = 1000.0


def robot_system_text(draft: Draft, robot: Path, name: str) -> str:
    """Return the text of a system file that names a robot file beside it.

    Joints of the robot are those of the logs by their names; where the names do not tell, in their order.
    Joints that do not move in the logs are locked.
    """
    read = _read(robot)
    joints, inputs = moving(read)
    if not joints:
        raise BadInput(f"{robot}: {STILL}")
    found = matched(draft, read, joints, robot)
    shown, drives = found.driven, dict(zip(joints, inputs, strict=False))
    by_name = "# Joints are those of the logs by their names."
    in_order = "# Question: joints are those of the logs in their order. Is it so?"
    unused = f"# {first_few(found.unused)} moves no mass in the robot file: its columns are not used."
    lines = [
        "# The robot file is the known physics. Its dry friction is left out: a diagnosis looks for it.",
        by_name if found.by_name else in_order,
        *([unused] if found.unused else []),
        *("schema: system/1", f"name: {word(name)}", f"model: {quoted(robot.name)}", "inputs:"),
        *(_input(joint, drives[joint], *shown[joint]) for joint in shown if joint in drives),
        "outputs:",
        *(line for joint in shown for line in _outputs(joint, *shown[joint])),
        *(line for joint, one in found.following.items() for line in _outputs(joint, *one)),
    ]
    currents = [joint for joint in shown if _is_current(shown[joint][1])]
    parameters = [*map(_constant, currents), *_gains(read, {drives[j] for j in shown if j in drives})]
    lines += ["parameters:", *parameters] if parameters else []
    if currents:
        lines += ["signals:", *(f"  drive_{joint}: k_{joint}*i_{joint}" for joint in currents)]
    return "\n".join([*lines, *locked_lines(found, joints)]) + "\n"


def with_goals(draft: Draft, robot: Path) -> Draft:
    """Return a draft whose joints follow commanded positions, if the actuators of a robot file are servos."""
    servos = [actuator.is_servo for actuator in _read(robot).actuators]
    return replace(draft, joints=tuple(map(with_goal, draft.joints))) if any(servos) else draft


def _read(robot: Path) -> Robot:
    """The robot of a file, without its equations, which take minutes for a long chain of joints."""
    return compiled(robot_text(robot), str(robot))


def _is_current(joint: Joint) -> bool:
    return joint.drive is not None and si_unit(joint.drive.unit) == "A"


def _input(joint: str, name: str, number: str, found: Joint) -> str:
    if found.drive is None:
        return f"  {name}: {{column: u{number}}}  # Question: which column drives {joint}? None was found."
    said = one_line(found.drive.signal.address)
    if _is_current(found):
        unit = quoted(found.drive.unit)
        return f"  i_{joint}: {{unit: {unit}, commanded: false, column: u{number}}}  # {said}"
    return f"  {name}: {{column: u{number}}}  # {said}. Question: is it what {name} stands for?"


def _outputs(joint: str, number: str, found: Joint) -> list[str]:
    said = one_line(found.position.signal.address)
    lines = [f"  q_{joint}: {{{_unit(found.position)}column: q{number}}}  # {said}"]
    if found.velocity is not None:
        lines.append(f"  qd_{joint}: {{{_unit(found.velocity)}column: w{number}}}")
    return lines


def _unit(channel: Channel) -> str:
    """The unit of a column, where it is not that of the robot file."""
    return "" if si_unit(channel.unit) == channel.unit else f"unit: {quoted(channel.unit)}, "


def _gains(robot: Robot, drives: Set[str]) -> Iterator[str]:
    """Gains of the position servos, which a simulation seldom has from the firmware."""
    asked = "  # Question: is it the gain of the firmware? Then remove this line."
    for actuator in robot.actuators:
        if actuator.is_servo and actuator.kp and f"u_{actuator.name}" in drives:
            yield f"  {actuator.name}_kp: {_within(actuator.kp, 1.0 / GAINS)}{asked}"
            if actuator.kv:
                yield f"  {actuator.name}_kv: {_within(actuator.kv, 0.0)}"


def _within(value: float, least: float) -> str:
    return f"{{identify: true, bounds: [{least * value:.3g}, {GAINS * value:.3g}]}}"


def _constant(joint: str) -> str:
    low, high = CONSTANTS
    asked = "# Question: which torque at the joint does one ampere make?"
    return f"  k_{joint}: {{value: 1, unit: N m/A, identify: true, bounds: [{low:g}, {high:g}]}}  {asked}"
