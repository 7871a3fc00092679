"""Torques of the actuators and springs of a robot as expressions of a system file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from unmodelled.systems.robot.bodies import Actuator, Robot
from unmodelled.systems.robot.links import Link, Tree

#: Text of a number of the file, given by element, quantity and value: the number, or a parameter's name.
Written = Callable[[str, str, float], str]


@dataclass(frozen=True)
class Activation:
    """State of an actuator that follows its input."""

    drive: str  # signal of the torque that depends on it
    unit: str
    initial: str  # expression of its initial value
    rate: str  # expression of its time derivative


@dataclass(frozen=True)
class Drives:
    """Torques on the joints of a robot; one without actuators has one input per joint, its torque."""

    robot: Robot
    tree: Tree
    written: Written

    @cached_property
    def inputs(self) -> dict[str, dict[str, str]]:
        """Entry of each input, by its name."""
        if not self.robot.actuators:
            joints = [self.robot.joints[k] for k in self.tree.leaders]
            return {f"tau_{joint.name}": {"unit": joint.units.effort} for joint in joints}
        moving = [a for a in self.robot.actuators if a.joint in self._links]
        return {f"u_{a.name}": {"unit": input_unit(self.robot, a)} for a in moving}

    @cached_property
    def followed(self) -> dict[str, dict[str, str]]:
        """Outputs of the joints that follow another one, by name."""
        found = {}
        for link in (link for links in self.tree.followers.values() for link in links):
            joint, (q, qd) = self.robot.joints[link.joint], self._motion(link)
            units, column = joint.units, joint.written
            found[f"q_{joint.name}"] = {"unit": units.position, "column": column, "expression": q}
            found[f"qd_{joint.name}"] = {"unit": units.speed, "expression": qd}
        return found

    @cached_property
    def activations(self) -> dict[str, Activation]:
        """Activation of each actuator that has a time constant, by the name of its state."""
        found = {}
        for actuator in self.robot.actuators:
            if actuator.timeconst and actuator.joint in self._links:
                unit = input_unit(self.robot, actuator)
                wanted = _clipped(f"u_{actuator.name}", actuator.inputs)
                slow = self.written(actuator.name, "timeconst", actuator.timeconst)
                name = activation(actuator.name)
                drive = f"drive_{self.robot.joints[self._links[actuator.joint].leader].name}"
                found[name] = Activation(drive, unit, wanted, f"({wanted} - {name})/{slow}")
        return found

    @cached_property
    def used(self) -> dict[str, list[str]]:
        """Names of the inputs that drive a joint, by the name of the joint's signal."""
        return {
            f"drive_{self.robot.joints[k].name}": [f"u_{a.name}" for _, a in self._of(k)]
            if self.robot.actuators
            else [f"tau_{self.robot.joints[k].name}"]
            for k in self.tree.leaders
        }

    @cached_property
    def drives(self) -> dict[str, str]:
        """Torque of the actuators of each joint, by the name of its signal."""
        if not self.robot.actuators:
            return {drive: inputs[0] for drive, inputs in self.used.items()}
        found = {}
        for k in self.tree.leaders:
            terms = [(link.ratio, self._torque(a, link)) for link, a in self._of(k)]
            texts = [term if ratio == 1.0 else f"{_number(ratio)}*({term})" for ratio, term in terms]
            found[f"drive_{self.robot.joints[k].name}"] = " + ".join(texts) or "0"
        return found

    @cached_property
    def torques(self) -> dict[str, str]:
        """Torque of actuators, damping and spring on each joint, by the name of its signal."""
        found = {}
        for k in self.tree.leaders:
            name = self.robot.joints[k].name
            terms = [(link.ratio, term) for link in self._moved(k) for term in self._passive(link)]
            texts = [term if ratio == 1.0 else f"{_number(ratio)}*{term}" for ratio, term in terms]
            found[f"torque_{name}"] = " - ".join([f"drive_{name}", *texts])
        return found

    def _passive(self, link: Link) -> list[str]:
        """Resistance of the damping and the spring at the joint of a link."""
        joint, (q, qd), terms = self.robot.joints[link.joint], self._motion(link), []
        damping = self.written(joint.name, "damping", joint.damping)
        stiffness = self.written(joint.name, "stiffness", joint.stiffness)
        if damping != "0.0":
            terms.append(f"{damping}*{qd}")
        if stiffness != "0.0":
            terms.append(f"{stiffness}*{_difference(q, joint.rest)}")
        return terms

    @cached_property
    def _links(self) -> dict[int, Link]:
        """Link of each moving joint, by number of the joint."""
        return {link.joint: link for link in self.tree.links}

    def _moved(self, k: int) -> list[Link]:
        """Link of a joint that moves by itself, and those of the joints that follow it."""
        return [self._links[k], *self.tree.followers[k]]

    def _of(self, k: int) -> list[tuple[Link, Actuator]]:
        """Actuators of a joint and of those that follow it, with their links."""
        return [(link, a) for link in self._moved(k) for a in self.robot.actuators if a.joint == link.joint]

    def _motion(self, link: Link) -> tuple[str, str]:
        """Position and speed of the joint of a link."""
        name = self.robot.joints[link.leader].name
        if link.joint == link.leader:
            return f"q_{name}", f"qd_{name}"
        ratio = "" if link.ratio == 1.0 else f"{_number(link.ratio)}*"
        start = f" + {_number(link.start)}" if link.start else ""
        return f"({ratio}q_{name}{start})", f"{ratio}qd_{name}"

    def _torque(self, actuator: Actuator, link: Link) -> str:
        """Torque of an actuator at the joint of a link: gear*force."""
        force = self._force(actuator, link)
        gear = self.written(actuator.name, "gear", actuator.gear)
        if gear == "1.0":
            return force
        single = force.startswith("clip(") or " " not in force
        return f"{gear}*{force}" if single else f"{gear}*({force})"

    def _force(self, actuator: Actuator, link: Link) -> str:
        wanted = _clipped(f"u_{actuator.name}", actuator.inputs)
        u = activation(actuator.name) if actuator.timeconst else wanted
        gear = self.written(actuator.name, "gear", actuator.gear)
        turned = "" if gear == "1.0" else f"{gear}*"
        q, qd = (f"{turned}{coordinate}" for coordinate in self._motion(link))
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
    """Return the name of the state of an actuator with a time constant."""
    return f"act_{actuator}"


def input_unit(robot: Robot, actuator: Actuator) -> str:
    """Return the unit of the input of an actuator."""
    units = robot.joints[actuator.joint].units
    if actuator.is_servo:
        return units.position if actuator.kp else units.speed
    return units.effort if actuator.gain == 1.0 else "1"


def _clipped(text: str, limits: tuple[float, float] | None) -> str:
    return text if limits is None else f"clip({text}, {limits[0]!r}, {limits[1]!r})"


def _number(value: float) -> str:
    return repr(value) if value >= 0 else f"({value!r})"


def _difference(name: str, value: float) -> str:
    return f"({name} - {_number(value)})" if value else name
