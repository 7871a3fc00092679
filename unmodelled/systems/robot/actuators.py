"""Torques of the actuators and springs of a robot as expressions of a system file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from unmodelled.systems.robot.bodies import Actuator, Joint, Robot
from unmodelled.systems.robot.properties import units_of

#: Text of a number of the file, given by element, quantity and value: the number, or a parameter's name.
Written = Callable[[str, str, float], str]


@dataclass(frozen=True)
class Activation:
    """State of an actuator that follows its input.

    Attributes:
        drive: name of the signal of the torque that depends on it.
        unit: unit of the state.
        initial: value at the start of an experiment.
        rate: time derivative.
    """

    drive: str
    unit: str
    initial: str
    rate: str


@dataclass(frozen=True)
class Drives:
    """Torques on the joints of a robot.

    Attributes:
        robot: robot with actuators; a robot without any has one input per joint, its torque.
        joints: numbers of the moving joints.
        written: text of a number of the file.
    """

    robot: Robot
    joints: tuple[int, ...]
    written: Written

    @cached_property
    def inputs(self) -> dict[str, dict[str, str]]:
        """Entry of each input, by its name."""
        if not self.robot.actuators:
            return {f"tau_{j.name}": {"unit": units_of(j).effort} for j in self._moving}
        moving = [a for a in self.robot.actuators if a.joint in self.joints]
        return {f"u_{a.name}": {"unit": input_unit(self.robot, a)} for a in moving}

    @cached_property
    def activations(self) -> dict[str, Activation]:
        """Activation of each actuator that has a time constant, by the name of its state."""
        found = {}
        for actuator in self.robot.actuators:
            if actuator.timeconst and actuator.joint in self.joints:
                unit, wanted = (
                    input_unit(self.robot, actuator),
                    _clipped(f"u_{actuator.name}", actuator.inputs),
                )
                slow = self.written(actuator.name, "timeconst", actuator.timeconst)
                name = activation(actuator.name)
                drive = f"drive_{self.robot.joints[actuator.joint].name}"
                found[name] = Activation(drive, unit, wanted, f"({wanted} - {name})/{slow}")
        return found

    @cached_property
    def used(self) -> dict[str, list[str]]:
        """Names of the inputs that drive a joint, by the name of the joint's signal."""
        return {
            f"drive_{self.robot.joints[k].name}": [f"u_{a.name}" for a in self._of(k)]
            if self.robot.actuators
            else [f"tau_{self.robot.joints[k].name}"]
            for k in self.joints
        }

    @cached_property
    def drives(self) -> dict[str, str]:
        """Torque of the actuators of each joint, by the name of its signal."""
        if not self.robot.actuators:
            return {drive: inputs[0] for drive, inputs in self.used.items()}
        found = {}
        for k in self.joints:
            terms = [self._torque(a) for a in self._of(k)]
            found[f"drive_{self.robot.joints[k].name}"] = " + ".join(terms) or "0"
        return found

    @cached_property
    def torques(self) -> dict[str, str]:
        """Torque of actuators, damping and spring on each joint, by the name of its signal."""
        found = {}
        for joint in self._moving:
            text = f"drive_{joint.name}"
            damping = self.written(joint.name, "damping", joint.damping)
            stiffness = self.written(joint.name, "stiffness", joint.stiffness)
            if damping != "0.0":
                text += f" - {damping}*qd_{joint.name}"
            if stiffness != "0.0":
                text += f" - {stiffness}*{_difference(f'q_{joint.name}', joint.rest)}"
            found[f"torque_{joint.name}"] = text
        return found

    @property
    def _moving(self) -> list[Joint]:
        return [self.robot.joints[k] for k in self.joints]

    def _of(self, k: int) -> list[Actuator]:
        return [a for a in self.robot.actuators if a.joint == k]

    def _torque(self, actuator: Actuator) -> str:
        """Torque of an actuator: gear*force."""
        force = self._force(actuator)
        gear = self.written(actuator.name, "gear", actuator.gear)
        if gear == "1.0":
            return force
        single = force.startswith("clip(") or " " not in force
        return f"{gear}*{force}" if single else f"{gear}*({force})"

    def _force(self, actuator: Actuator) -> str:
        joint = self.robot.joints[actuator.joint]
        wanted = _clipped(f"u_{actuator.name}", actuator.inputs)
        u = activation(actuator.name) if actuator.timeconst else wanted
        gear = self.written(actuator.name, "gear", actuator.gear)
        turned = "" if gear == "1.0" else f"{gear}*"
        q, qd = f"{turned}q_{joint.name}", f"{turned}qd_{joint.name}"
        kp, kv = (self.written(actuator.name, n, getattr(actuator, n)) for n in ("kp", "kv"))
        if actuator.is_servo and actuator.kp:
            force = f"{kp}*({u} - {q})" + (f" - {kv}*{qd}" if actuator.kv else "")
        elif actuator.is_servo:
            force = f"{kv}*({u} - {qd})"
        else:
            gain = self.written(actuator.name, "gain", actuator.gain)
            force = u if gain == "1.0" else f"{gain}*{u}"
            force += (f" - {kp}*{q}" if actuator.kp else "") + (f" - {kv}*{qd}" if actuator.kv else "")
        if actuator.bias:
            force += f" + {_number(actuator.bias)}"
        return _clipped(force, actuator.forces)


def activation(actuator: str) -> str:
    """Return the name of the state of an actuator with a time constant.

    Args:
        actuator: name of the actuator.
    """
    return f"act_{actuator}"


def input_unit(robot: Robot, actuator: Actuator) -> str:
    """Return the unit of the input of an actuator.

    Args:
        robot: robot of the actuator.
        actuator: actuator; the input of a servo is the wanted position or speed.
    """
    units = units_of(robot.joints[actuator.joint])
    if actuator.is_servo:
        return units.position if actuator.kp else units.speed
    return units.effort if actuator.gain == 1.0 else "1"


def _clipped(text: str, limits: tuple[float, float] | None) -> str:
    return text if limits is None else f"clip({text}, {limits[0]!r}, {limits[1]!r})"


def _number(value: float) -> str:
    return repr(value) if value >= 0 else f"({value!r})"


def _difference(name: str, value: float) -> str:
    return f"({name} - {_number(value)})" if value else name
