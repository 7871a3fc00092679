"""The text of a drafted system file."""

from __future__ import annotations

import numpy as np

from unmodelled.drafting.balance_text import balance_text, over_unit
from unmodelled.drafting.draft import Draft
from unmodelled.drafting.joints import Joint
from unmodelled.drafting.lines import identified, numbered, one_line, quoted, system_file
from unmodelled.drafting.names import Role, is_measured
from unmodelled.drafting.units import si_unit
from unmodelled.systems.units import describe, parse_logged, parse_unit

#: Other columns that are named in a comment.
NAMES = 5
#: Area of a piston until somebody tells, m^2.
PISTON = 1e-3
#: Stiffness and damping of a joint that follows a commanded position, by its inertia: a servo of 10 rad/s.
STIFFNESS, DAMPING = 100.0, 20.0


def system_text(draft: Draft, name: str) -> str:
    """Return the text of a system file with one inertia or mass per joint, or one store per level."""
    if draft.balances:
        return balance_text(draft.balances, name)
    joints = list(numbered(draft.joints))
    sections = {
        "states": [line for k, joint in joints for line in _states(k, joint)],
        "inputs": [line for k, joint in joints for line in _input(k, joint)],
        "outputs": [line for k, joint in joints for line in _outputs(k, joint)],
        "parameters": [line for k, joint in joints for line in _parameters(k, joint)],
        "ports": [_port(k, joint) for k, joint in joints],
        "dynamics": [line for k, joint in joints for line in _dynamics(k, joint)],
    }
    comments = (
        "A first model: one body per position that moves. It lacks what you know of the machine: gravity,",
        "gears, coupling between joints. Add that, answer the questions, and run simulate again.",
    )
    return system_file(comments, name, sections)


def _units(joint: Joint) -> tuple[str, str, str, str]:
    """SI units of position and speed, of effort and of inertia."""
    return ("rad", "rad/s", "N m", "kg m^2") if joint.angular else ("m", "m/s", "N", "kg")


def _states(k: str, joint: Joint) -> list[str]:
    position, speed, *_ = _units(joint)
    return [
        f"  q{k}: {{unit: {position}}}  # {one_line(joint.position.signal.address)}",
        f"  w{k}: {{unit: {speed}}}",
    ]


def _input(k: str, joint: Joint) -> list[str]:
    if joint.drive is None:
        return []
    said, closed = joint.drive.signal.address, []
    if joint.goal is not None:
        goal = one_line(joint.goal.address)
        asked = "the loop is closed, and a controller makes"
        closed = [f"  # {goal} is the set point of q{k}: {asked} u{k} from both."]
    if not joint.trusted or joint.others:
        kind = "commanded position" if joint.servo else "effort"
        said += f". Question: is this {kind} what drives q{k}?"
    if joint.others:
        said += f" Others: {', '.join(signal.address for signal in joint.others[:NAMES])}"
    measured = ", commanded: false" if is_measured(joint.drive.signal.address) else ""
    measured += ", hold: true" if joint.drive.signal.held else ""
    lines = [*closed, f"  u{k}: {{unit: {quoted(joint.drive.unit)}{measured}}}  # {one_line(said)}"]
    if joint.against is not None:
        second, held = one_line(joint.against.signal.address), joint.against.signal.held
        unit = quoted(joint.against.unit) + (", hold: true" if held else "")
        lines.append(f"  u{k}_2: {{unit: {unit}}}  # {second}")
    return lines


def _outputs(k: str, joint: Joint) -> list[str]:
    shown = {"q": joint.position, "w": joint.velocity}
    return [f"  {s}{k}: {{unit: {quoted(each.unit)}}}" for s, each in shown.items() if each is not None]


def _parameters(k: str, joint: Joint) -> list[str]:
    return _servo(k, joint) if joint.servo else _body(k, joint)


def _servo(k: str, joint: Joint) -> list[str]:
    """Inertia of a joint that follows a commanded position, with stiffness and damping of its loop."""
    position, _, effort, inertia = _units(joint)
    fitted = joint.trusted and joint.fit.gain > 0.0
    stiffness, damping = (joint.fit.gain, joint.fit.damping) if fitted else (STIFFNESS, DAMPING)
    damping = damping if damping > 0.0 else 2.0 * float(np.sqrt(stiffness))
    return [
        f"  # u{k} is a set point: the loop is closed, and K{k} and D{k} stand for its controller.",
        f"  # Question: what is the inertia of q{k}? Positions give no torques: K{k} and D{k} go with it.",
        f"  J{k}: {{value: 1, unit: {inertia}, guess: true}}",
        f"  K{k}: {identified(stiffness, f'{effort}/{position}')}",
        f"  D{k}: {identified(damping, f'{effort} s/{position}')}",
    ]


def _body(k: str, joint: Joint) -> list[str]:
    """Inertia and viscous friction of a joint, and the effort that one unit of its input makes."""
    position, _, effort, inertia = _units(joint)
    factor = PISTON if joint.drive and joint.drive.signal.role is Role.PRESSURE else 1.0
    size = factor / abs(joint.fit.gain) if joint.trusted else 1.0
    damping = size * joint.fit.damping if joint.trusted and joint.fit.damping > 0.0 else 0.0
    origin = "fitted to the logs" if joint.trusted else "a guess"
    mass = "inertia" if joint.angular else "mass"
    lines = [f"  # Question: what is the {mass} of q{k}? This one is {origin}."]
    if joint.drive is None:
        lines = [f"  # Question: which column drives q{k}? None was found.", *lines]
    if joint.drive is not None and (unit := _factor(joint)) is not None:
        area = f" (the area of its piston, m^2). {PISTON:g} is a guess." if factor != 1.0 else ""
        own = si_unit(joint.drive.unit)
        one = f"u{k} = 1" if own == "1" else f"one {own} of u{k}"
        lines.append(f"  # Question: which {effort} does {one} make?{area}")
        lines.append(f"  k{k}: {{value: {factor:g}, unit: {quoted(unit)}, guess: true}}")
    if joint.against is not None:
        lines.append("  # Question: what is the area on the other side of the piston? Fitted to the logs.")
        lines.append(f"  k{k}_2: {identified(factor * joint.against.scale, 'N/Pa')}")
    return [
        *lines,
        f"  J{k}: {identified(size, inertia)}",
        f"  b{k}: {identified(damping, f'{effort} s/{position}', (0.0, max(10.0 * damping, size)))}",
    ]


def _factor(joint: Joint) -> str | None:
    """Unit of the factor between input and effort; None if the input is an effort."""
    if joint.drive is None:
        return None
    effort = _units(joint)[2]
    own = parse_logged(joint.drive.unit)[0].dimension
    if own == parse_unit(effort).dimension:
        return None
    return over_unit(effort, describe(own))


def _port(k: str, joint: Joint) -> str:
    kind = "joint" if joint.angular else "rail"
    return f"  {kind}{k}: {{effort: tau{k}, unit: {_units(joint)[2]}, position: q{k}, velocity: w{k}}}"


def _dynamics(k: str, joint: Joint) -> list[str]:
    if joint.servo:
        forces = f"K{k}*(u{k} - q{k}) - D{k}*w{k} - tau{k}"
    else:
        drive = "" if joint.drive is None else f"k{k}*u{k} " if _factor(joint) else f"u{k} "
        drive += f"- k{k}_2*u{k}_2 " if joint.against is not None else ""
        forces = f"{drive}- b{k}*w{k} - tau{k}"
    return [f"  q{k}: w{k}", f"  w{k}: ({forces})/J{k}"]
