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
    """Efforts on the moving joints of a robot.

    Attributes:
        system: system of the robot as it was given.
        robot: content of its file.
    """

    system: System
    robot: Robot

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the moving joints."""
        return tuple(self.robot.joints[link.joint].name for link in self.tree.links)

    @cached_property
    def controls(self) -> dict[str, tuple[str, ...]]:
        """Names of the inputs of the actuators by joint, where the system drives the joint as its file does."""
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

        return Drives(self.robot, tuple(link.joint for link in self.tree.links), written)

    @cached_property
    def tree(self) -> Tree:
        """Moving links."""
        locked = {} if self.system.robot is None else self.system.robot.locked
        return Tree.of(self.robot, {k: locked[j.written] for k, j in enumerate(self.robot.joints) if j.written in locked})

    def of_file(self, system: System) -> dict[str, sp.Expr]:
        """Return the effort that the file makes on each joint: by its actuators, its damping and its spring.

        Where the system does not drive a joint as its file does, the symbol applied_<joint> stands for the
        effort that is applied to the joint.

        Args:
            system: system with the numbers of the file that are parameters, possibly with effects.
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

    def of(self, system: System) -> dict[str, sp.Expr]:
        """Return the whole effort that moves each joint in a system, with the known laws of its ports.

        What is applied to a joint, see `of_file`, is its symbol.

        Args:
            system: system of the robot, possibly with effects.

        Raises:
            BadInput: if the system file has other dynamics than the robot.
        """
        scope = scope_of(system)
        laws = {symbol(p.effort): sp.S.Zero if p.law is None else p.law for p in system.ports}
        rates = dict(zip((state.name for state in system.states), system.dynamics, strict=True))
        applied = self.applied(system)
        known = {e: _name(name, e) for name, e in applied.items()}
        found = {}
        for name in self.joints:
            text = system.text.get(f"dynamics.qd_{name}", "")
            call = syntax.tree(text, text)[1] if text else None
            own = isinstance(call, ast.Call) and ast.unparse(call.func) == f"acceleration_{name}"
            if not own or grammar.parse(text, scope, text) != rates[f"qd_{name}"]:
                raise BadInput(f"dynamics.qd_{name} is not the acceleration of the robot file")
            argument = ast.unparse(call.args[self._order.index(name)])
            whole = grammar.parse(argument, scope, text).xreplace(laws)
            if name in applied:  # a sum is taken out as a whole
                whole = whole - applied[name] + known[applied[name]]
            found[name] = whole.xreplace(known)
        return found

    @property
    def _order(self) -> list[str]:
        """Joints in the order of the first arguments of their accelerations."""
        robot = self.system.robot
        assert robot is not None
        arguments = robot.functions[f"acceleration_{self.joints[0]}"].arguments
        start = "robot.torque_"
        return [str(x).removeprefix(start) for x in arguments if str(x).startswith(start)]

    def applied(self, system: System) -> dict[str, sp.Expr]:
        """Return the effort that is applied to each joint that its file does not drive as the system does.

        Args:
            system: system of the robot, possibly with effects.
        """
        return {n: system.signals[f"drive_{n}"] for n in self.joints if n not in self.controls}


def _name(joint: str, effort: sp.Expr) -> sp.Expr:
    """Symbol of the effort that is applied to a joint; a number needs no name."""
    return effort if effort.is_number else symbol(f"applied_{joint}")
