"""Efforts on the joints of a robot: those of a system, and those that its robot file makes by itself."""

from __future__ import annotations

import ast
from dataclasses import dataclass, replace
from functools import cached_property

import sympy as sp

from unmodelled.base.errors import BadInput
from unmodelled.systems import grammar, syntax
from unmodelled.systems.model import System, symbol
from unmodelled.systems.robot.actuators import Drives
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.links import Tree
from unmodelled.systems.scope import Scope, Value, scope_of


@dataclass(frozen=True)
class Efforts:
    """Efforts on the moving joints of a robot, of a system as it was given."""

    system: System
    robot: Robot

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that move by themselves."""
        return tuple(self.robot.joints[k].name for k in self.tree.leaders)

    @property
    def moving(self) -> tuple[str, ...]:
        """Names of all moving joints, with those that follow another joint."""
        return tuple(self.robot.joints[link.joint].name for link in self.tree.links)

    @cached_property
    def controls(self) -> dict[str, tuple[str, ...]]:
        """Inputs of the actuators by joint, where the system drives the joint as its file does."""
        found = {}
        scope = scope_of(self.system)
        for name in self.joints if self.robot.actuators else ():
            inputs = self._drives.used[f"drive_{name}"]
            if inputs and all(i in scope.values for i in inputs):
                own = grammar.parse(self._drives.drives[f"drive_{name}"], scope, "")
                if own == self.system.signals[f"drive_{name}"]:
                    found[name] = tuple(inputs)
        return found

    @cached_property
    def _drives(self) -> Drives:
        parameters = {p.name for p in self.system.parameters}

        def written(element: str, quantity: str, value: float) -> str:
            name = f"{element}_{quantity}"
            return name if name in parameters else repr(value)

        return Drives(self.robot, self.tree, written)

    @cached_property
    def tree(self) -> Tree:
        """Moving links."""
        locked = {} if self.system.robot is None else self.system.robot.locked
        numbers = {k: joint.written for k, joint in enumerate(self.robot.joints) if joint.written in locked}
        return Tree.of(self.robot, {k: locked[written] for k, written in numbers.items()})

    def of_file(self, system: System) -> dict[str, sp.Expr]:
        """Return the effort on each joint of the actuators, the damping and the spring of the file.

        Where the system does not drive a joint as its file does, applied_<joint> stands for what is applied.
        """
        scope, found = scope_of(system), {}
        for name in self.joints:
            if name in self.controls:
                drive = grammar.parse(self._drives.drives[f"drive_{name}"], scope, "")
            else:
                drive = _name(name, self.applied(system)[name])
            values = {**scope.values, f"drive_{name}": Value(drive)}
            text = self._drives.torques[f"torque_{name}"]
            found[name] = grammar.parse(text, replace(scope, values=values), "")
        return found

    def of(self, system: System, laws: bool = True) -> dict[str, sp.Expr]:
        """Return the whole effort on each joint; what is applied to a joint is its symbol, see `of_file`."""
        scope, applied = scope_of(system), self.applied(system)
        at_ports = {symbol(p.effort): (p.law if laws else None) or sp.S.Zero for p in system.ports}
        known = {e: _name(name, e) for name, e in applied.items()}
        found = {}
        for name in self.joints:
            whole = grammar.parse(self._written(system, name, scope), scope, name).xreplace(at_ports)
            if name in applied:  # a sum is taken out as a whole
                whole = whole - applied[name] + known[applied[name]]
            found[name] = whole.xreplace(known)
        return found

    def _written(self, system: System, joint: str, scope: Scope) -> str:
        """Effort on a joint as text: an argument of the acceleration of the joint."""
        place, function = f"dynamics.qd_{joint}", f"acceleration_{joint}"
        text = system.text.get(place, "0")
        call = syntax.tree(text, place)[1]
        rate = system.dynamics[[state.name for state in system.states].index(f"qd_{joint}")]
        own = isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == function
        if not (own and isinstance(call, ast.Call) and grammar.parse(text, scope, place) == rate):
            raise BadInput(f"{place} is not the acceleration of the robot file")
        assert system.robot is not None
        arguments = map(str, system.robot.functions[function].arguments)
        return ast.unparse(call.args[[*arguments].index(f"robot.torque_{joint}")])

    def applied(self, system: System) -> dict[str, sp.Expr]:
        """Return the effort that is applied to each joint that its file does not drive as the system does."""
        return {n: system.signals[f"drive_{n}"] for n in self.joints if n not in self.controls}


def _name(joint: str, effort: sp.Expr) -> sp.Expr:
    """Symbol of the effort that is applied to a joint; a number needs no name."""
    return effort if effort.is_number else symbol(f"applied_{joint}")
