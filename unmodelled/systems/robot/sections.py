"""Sections of a system file that a robot file stands for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property

import sympy as sp

from unmodelled.base.errors import closest, first_few
from unmodelled.systems import units
from unmodelled.systems.document import Node, file_beside
from unmodelled.systems.robot.actuators import Activation, Drives
from unmodelled.systems.robot.bodies import Joint, Robot
from unmodelled.systems.robot.compile import compiled
from unmodelled.systems.robot.dynamics import Coordinates, Dynamics
from unmodelled.systems.robot.files import LARGEST, robot_text
from unmodelled.systems.robot.links import Tree
from unmodelled.systems.robot.model import MotionFunction, RobotModel
from unmodelled.systems.robot.numbers import Property, properties
from unmodelled.systems.robot.spatial import number
from unmodelled.systems.robot.standing import KEYS, standing, without_standing
from unmodelled.systems.syntax import names, shown
from unmodelled.systems.units import parse_unit

Entries = Mapping[str, Mapping[str, str]] | Mapping[str, str]


def with_robot(
    sections: Mapping[str, Node], numbers: Sequence[str] = ()
) -> tuple[dict[str, Node], RobotModel]:
    """Return the sections of a system file with those of its robot, and the robot.

    Inputs and outputs of the system file replace those of the robot. In all other sections its entries are
    added, and its fields replace those of an entry of the same name.
    """
    path = file_beside(sections["model"], LARGEST)
    text = robot_text(path)
    robot = compiled(text, str(path))
    locked, still = standing(sections, robot)
    moving, unused = without_standing(sections, robot, locked)
    robot = replace(robot, notes=(*robot.notes, *still, *unused))
    return _Sections(moving, robot, locked, text, tuple(numbers)).read()


def moving(robot: Robot) -> tuple[list[str], list[str]]:
    """Return the joints that move by themselves, and the inputs that drive them, by name and in order.

    These are the joints and inputs of a system file that names the robot and nothing else.
    """
    tree = Tree.of(robot, robot.resting({}))
    drives = Drives(robot, tree, lambda element, quantity, value: repr(value))
    used = {name for inputs in drives.used.values() for name in inputs}
    return [robot.joints[k].name for k in tree.leaders], [name for name in drives.inputs if name in used]


@dataclass
class _Sections:
    sections: dict[str, Node]
    robot: Robot
    locked: dict[int, float]
    text: str
    numbers: tuple[str, ...] = ()
    zeros: list[str] = field(default_factory=list)  # of the patterns: numbers without bounds around them

    def read(self) -> tuple[dict[str, Node], RobotModel]:
        functions = self._functions()
        used = {str(x) for f in functions.values() for x in f.procedure.inputs}
        rates = {name: a.rate for name, a in self._activations.items()}
        moves = {*used, *_words(self.drives.drives), *_words(self.drives.torques), *_words(rates)}
        idle = [p for p in self.parameters if p.name not in moves]
        own: dict[str, Entries] = {
            "states": {
                **{f"{s}_{j.name}": {"unit": u} for s, j, u in self._states},
                **{name: {"unit": a.unit, "initial": a.initial} for name, a in self._activations.items()},
            },
            "inputs": self.drives.inputs,
            "outputs": {
                **{f"{s}_{j.name}": {"unit": u, **_column(s, j)} for s, j, u in self._states},
                **self.drives.followed,
            },
            "parameters": {p.name: self._parameter(p) for p in self.parameters if p not in idle},
            "signals": {**self.drives.drives, **self.drives.torques},
            "ports": {j.name: self._port(j) for j in self.joints},
            "dynamics": self._dynamics(functions),
        }
        sections = {name: node for name, node in self.sections.items() if name not in KEYS}
        for name, entries in own.items():
            sections[name] = self._merged(name, entries)
        locked = {self.robot.joints[k].written: value for k, value in self.locked.items()}
        notes = [f"{p.name} has no influence on the motion: it is not identified" for p in idle]
        if zeros := [name for name in self.zeros if name not in {p.name for p in self.parameters}]:
            words = "to identify them, give them bounds in parameters"
            notes.append(f"{', '.join(zeros)} are 0 in the robot file: {words}")
        given = self._given("locked")
        if free := [j.written for j in self.robot.joints if j.follows and {j.name, j.written} & given.keys()]:
            words = "locked, so that it follows no other joint: remove it from locked"
            notes.append(f"{first_few(free)}: {words}")
        file = self.sections["model"].text()
        notes = [*self.robot.notes, *notes]
        rates = {name: str(text) for name, text in own["dynamics"].items()}
        numbers = {p.name: (p.element, p.quantity) for p in self.parameters}
        return sections, RobotModel(file, self.text, locked, functions, tuple(notes), rates, numbers)

    @cached_property
    def tree(self) -> Tree:
        return Tree.of(self.robot, self.locked)

    @cached_property
    def joints(self) -> list[Joint]:
        """Joints that move by themselves, in the order of the links."""
        return [self.robot.joints[k] for k in self.tree.leaders]

    @property
    def _states(self) -> list[tuple[str, Joint, str]]:
        positions = [("q", j, j.units.position) for j in self.joints]
        return [*positions, *(("qd", j, j.units.speed) for j in self.joints)]

    @cached_property
    def parameters(self) -> list[Property]:
        """Numbers of the robot file that are parameters of the system."""
        given = self._given("parameters")
        return [
            p
            for p in self.known
            if p.name in given or p.name in self.identified or (p.value and any(map(p.matches, self.numbers)))
        ]

    def _given(self, section: str) -> dict[str, Node]:
        """Entries of a section of the system file."""
        return self.sections[section].entries() if section in self.sections else {}

    @cached_property
    def known(self) -> list[Property]:
        return list(properties(self.robot, self.tree))

    @cached_property
    def identified(self) -> set[str]:
        """Names of the parameters that the patterns of `identify` name."""
        found = set[str]()
        if "identify" not in self.sections:
            return found
        for node in self.sections["identify"].items():
            named = [p for p in self.known if p.matches(node.text())]
            if not named:
                names = [f"{p.element}.{p.quantity}" for p in self.known]
                raise node.wrong(f"names no number of the robot{closest(node.text(), names)}")
            found |= {p.name for p in named if p.value}
            self.zeros += [p.name for p in named if not p.value and p.name not in self.zeros]
            if not any(p.value for p in named):
                words = "give it bounds in parameters"
                raise node.wrong(f"is 0 in the robot file, which has no bounds around it: {words}")
        return found

    def _parameter(self, p: Property) -> dict[str, str]:
        entries = {"value": repr(p.value), "unit": p.unit}
        return entries | {"identify": "true"} if p.name in self.identified else entries

    @cached_property
    def drives(self) -> Drives:
        names = {(p.element, p.quantity): p.name for p in self.parameters}
        return Drives(self.robot, self.tree, lambda e, quantity, value: names.get((e, quantity), repr(value)))

    @cached_property
    def _activations(self) -> dict[str, Activation]:
        """States of the actuators that drive a joint; a signal of the system file replaces them."""
        given = self._given("signals")
        return {name: a for name, a in self.drives.activations.items() if a.drive not in given}

    def _port(self, joint: Joint) -> dict[str, str]:
        entries = {"effort": f"load_{joint.name}", "unit": joint.units.effort}
        entries |= {"position": f"q_{joint.name}", "velocity": f"qd_{joint.name}"}
        driven = self.drives.drives[f"drive_{joint.name}"] != "0"
        return entries | {"load": f"drive_{joint.name}"} if driven else entries

    def _functions(self) -> dict[str, MotionFunction]:
        """Accelerations, and derivatives of the accelerations by the torques of their joints."""
        symbols = {(p.element, p.quantity): sp.Symbol(p.name, real=True) for p in self.parameters}
        places = [
            # the dot keeps the name apart from those of a system file
            Coordinates(*(sp.Symbol(f"{s}_{j.name}", real=True) for s in ("q", "qd", "robot.torque")))
            for j in self.joints
        ]
        dynamics = Dynamics(
            self.robot,
            self.tree,
            places,
            lambda element, quantity, value: symbols.get((element, quantity)) or number(value),
        )
        procedures, slopes = dynamics.accelerations(), dynamics.mobilities()
        used = {x for procedure in procedures for x in procedure.inputs}
        shared = [p for p in self.parameters if symbols[p.element, p.quantity] in used]
        own = {symbols[p.element, p.quantity]: parse_unit(p.unit).dimension for p in shared}
        efforts = [parse_unit(j.units.effort).dimension for j in self.joints]
        torques = dict(zip((place.torque for place in places), efforts, strict=True))
        found = {}
        for joint, place, procedure, slope in zip(self.joints, places, procedures, slopes, strict=True):
            unit = parse_unit(f"{joint.units.speed}/s").dimension
            name = f"acceleration_{joint.name}"
            found[name] = MotionFunction(name, procedure, {**torques, **own}, unit)
            procedure.give_slope(procedure.inputs.index(place.torque), slope)
            unit = units.times(unit, units.power(torques[place.torque], Fraction(-1)))
            name = f"mobility_{joint.name}"
            found[name] = MotionFunction(name, slope, own, unit)
        return found

    def _dynamics(self, functions: Mapping[str, MotionFunction]) -> dict[str, str]:
        torques = [f"torque_{j.name} - load_{j.name}" for j in self.joints]
        first = functions[f"acceleration_{self.joints[0].name}"]
        arguments = ", ".join([*torques, *map(str, [*first.arguments][len(torques) :])])
        rates = {f"q_{j.name}": f"qd_{j.name}" for j in self.joints}
        rates |= {f"qd_{j.name}": f"acceleration_{j.name}({arguments})" for j in self.joints}
        return rates | {name: a.rate for name, a in self._activations.items()}

    def _merged(self, section: str, own: Entries) -> Node:
        """A section with the entries of the robot and those of the system file."""
        model = self.sections["model"]
        base = self.sections.get(section) or replace(model, place=section, content=None)
        given = base.entries()
        entries = {name: _node(model, f"{section}.{name}", content) for name, content in own.items()}
        for name in given.keys() & entries.keys():
            fields, own_fields = given[name].content, entries[name].content
            if isinstance(own_fields, dict) and (fields is None or isinstance(fields, dict)):
                given = {**given, name: replace(given[name], content={**own_fields, **(fields or {})})}
        match section:
            case "inputs":
                found = self._driving(base, given, entries)
            case "outputs":
                positions = {f"q_{joint.name}" for joint in self.joints}
                found = given or {n: e for n, e in entries.items() if n in positions}
            case "signals":
                drives = {n: e for n, e in entries.items() if n in self.drives.drives and n not in given}
                torques = {n: e for n, e in entries.items() if n in self.drives.torques and n not in given}
                found = {**drives, **given, **torques}
            case _:
                found = {**entries, **given}
        return replace(base, content=found)

    def _driving(self, base: Node, given: dict[str, Node], own: dict[str, Node]) -> dict[str, Node]:
        """Inputs of the system file, or those of the robot that no signal of the system file replaces."""
        signals = self._given("signals")
        used = self.drives.used.items()
        needed = {name: drive for drive, inputs in used if drive not in signals for name in inputs}
        if not base.entries():
            return {name: node for name, node in own.items() if name in needed}
        for name, drive in needed.items():
            if name not in given:
                advice = f"add it, write signals.{drive} (0: nothing drives the joint), or lock the joint"
                raise base.wrong(f"the input {shown(name)} of the robot is missing: {advice}")
        return given


def _column(state: str, joint: Joint) -> dict[str, str]:
    """Column of the log that shows a state: the position has the name of the joint."""
    return {"column": joint.written} if state == "q" else {}


def _words(texts: Mapping[str, str]) -> set[str]:
    return {word for text in texts.values() for word in names(text)}


def _node(model: Node, place: str, content: str | Mapping[str, str]) -> Node:
    """A part of the robot, whose line in the system file is that of the robot."""
    if isinstance(content, str):
        return replace(model, place=place, content=content)
    fields = {key: replace(model, place=f"{place}.{key}", content=text) for key, text in content.items()}
    return replace(model, place=place, content=fields)
