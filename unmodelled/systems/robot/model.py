"""Robot of a system: its file, and the functions that the equations of the system can call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import sympy as sp

from unmodelled.systems.procedure import Procedure, evaluated
from unmodelled.systems.units import Dimension


@dataclass(frozen=True)
class MotionFunction:
    """Function of a robot at the state of the system.

    `acceleration_<joint>` depends on the torques of all joints and on the parameters of the robot,
    `mobility_<joint>`, its derivative by the torque of the joint, on the parameters.
    """

    name: str
    procedure: Procedure
    arguments: Mapping[sp.Symbol, Dimension]  # dimension of each argument, in order
    unit: Dimension  # dimension of the result

    def __call__(self, values: Sequence[sp.Expr]) -> sp.Expr:
        """Return a call of the function as an expression."""
        known = {x: x for x in self.procedure.inputs} | dict(zip(self.arguments, values, strict=True))
        return evaluated.at(self.procedure, known)

    def written(self, call: evaluated) -> list[sp.Expr]:
        """Return the arguments of a call, in order."""
        values = dict(zip(self.procedure.inputs, call.args[1:], strict=True))
        return [values.get(x, sp.Float(0.0)) for x in self.arguments]


@dataclass(frozen=True)
class RobotModel:
    """Robot whose equations are part of a system."""

    file: str = field(compare=False)  # name as written in the system file
    text: str
    #: coordinate (rad or m) of each joint that does not move, by its name in the file
    locked: Mapping[str, float]
    functions: Mapping[str, MotionFunction]
    notes: tuple[str, ...] = field(default=(), compare=False)  # what the file says and the equations do not
    #: equations that a system file need not write, by state
    dynamics: Mapping[str, str] = field(default_factory=dict, compare=False)
    #: element and quantity of each parameter that is a number of the file, by its name
    numbers: Mapping[str, tuple[str, str]] = field(default_factory=dict, compare=False)

    def function(self, call: evaluated) -> MotionFunction | None:
        """Return the function that a call calls; None if it is another procedure, such as a derivative."""
        return next((f for f in self.functions.values() if f.procedure == call.args[0]), None)
