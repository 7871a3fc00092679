"""Numbers of a robot file as parameters of its system: what is a parameter may be found wrong."""

from __future__ import annotations

from unmodelled.base.errors import BadInput
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

#: Numbers of joints, drives and links; an error of the others acts as that of one of these, or as a gain.
NUMBERS = ("*.kp", "*.kv", "*.damping", "*.stiffness", "*.armature", "*.mass", "*.com_?")


def with_robot_numbers(system: System) -> System:
    """Return the system with numbers of its robot file as parameters, which the file says are known."""
    if system.robot is None or not system.source:
        return system
    try:
        grown = read_system(system.source, NUMBERS)
    except BadInput:
        return system
    channels = [(s.x, s.inputs, s.outputs, s.ports, s.uncertain) for s in (system, grown)]
    if grown.robot is None or grown.robot.text != system.robot.text or channels[0] != channels[1]:
        return system
    values = dict(zip((p.name for p in system.parameters), system.values, strict=True))
    return grown.with_values(values)
