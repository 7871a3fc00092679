"""Mass properties of the links of a robot, as expressions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp

from unmodelled.systems.robot.bodies import Body, Robot
from unmodelled.systems.robot.links import Link, Placement
from unmodelled.systems.robot.numbers import SCALE
from unmodelled.systems.robot.spatial import ZERO, Matrix, Steps, Vector, number, transposed

#: Value of a number of a robot file, given by element ("elbow"), quantity ("armature") and value in the file:
#: a number, or the symbol of a parameter.
Value = Callable[[str, str, float], sp.Expr]
_AXES = "xyz"


@dataclass(frozen=True)
class Inertia:
    """Mass properties of a rigid body about the origin of a frame."""

    mass: sp.Expr  # kg
    moment: Vector  # mass times centre of mass, kg m
    matrix: Matrix  # about the origin, kg m^2


def of_link(s: Steps, robot: Robot, link: Link, value: Value) -> Inertia:
    """Return the mass properties of a link in its frame, without those of the links that it carries."""
    whole = Inertia(sp.S.Zero, ZERO, (ZERO, ZERO, ZERO))
    for k, placement in link.bodies.items():
        whole = joined(s, whole, _placed(s, robot.bodies[k], placement, value))
    return whole


def _placed(s: Steps, body: Body, place: Placement, value: Value) -> Inertia:
    """Mass properties of a body about the origin of its link.

    With another mass, the inertia about the centre of mass grows in proportion: the whole pseudo-inertia is
    multiplied, so that it stays that of a solid body (P. Wensing, S. Kim, J.-J. Slotine, 2018).
    """
    mass = value(body.name, "mass", body.mass)
    scale = value(body.name, SCALE, 1.0)
    if mass.free_symbols and body.mass > 0.0:
        scale = scale * mass / number(body.mass)
    com = [value(body.name, f"com_{a}", float(x)) for a, x in zip(_AXES, body.com, strict=True)]

    def moment_of(i: int, j: int) -> sp.Expr:
        i, j = min(i, j), max(i, j)
        own = value(body.name, f"inertia_{_AXES[i]}{_AXES[j]}", float(body.inertia[i, j]))
        return own if own.free_symbols else scale * own

    rotation = sp.Matrix(3, 3, [number(x) for x in place.rotation.ravel()])
    position = sp.Matrix([number(x) for x in place.position]) + rotation * sp.Matrix(com)
    turned = rotation * sp.Matrix(3, 3, moment_of) * rotation.T
    matrix = turned + mass * (position.dot(position) * sp.eye(3) - position * position.T)
    a, b, c = (s.vector([sp.expand(x) for x in matrix.row(i)]) for i in range(3))
    return Inertia(s(mass), s.vector([sp.expand(mass * x) for x in position]), (a, b, c))


def moved(s: Steps, inertia: Inertia, rotation: Matrix, origin: Vector) -> Inertia:
    """Return mass properties about the origin of another frame, in that frame; origin in m."""
    mass, p = inertia.mass, origin
    h = s.times(rotation, inertia.moment)
    x, y, z = (s.times(rotation, row) for row in inertia.matrix)
    half = transposed((x, y, z))  # rotation times matrix
    cross = [[s(a * b) for b in h] for a in p]
    square = [[mass * a * b for b in p] for a in p]
    trace = 2 * s(cross[0][0] + cross[1][1] + cross[2][2]) + square[0][0] + square[1][1] + square[2][2]
    found: list[list[sp.Expr]] = [[sp.S.Zero] * 3 for _ in range(3)]
    for i in range(3):
        for j in range(i + 1):
            turned = sp.Add(*(half[i][n] * rotation[j][n] for n in range(3)))
            whole = turned - cross[i][j] - cross[j][i] - square[i][j] + (trace if i == j else 0)
            found[i][j] = found[j][i] = s(whole)
    moment = s.plus(h, (mass * p[0], mass * p[1], mass * p[2]))
    a, b, c = ((row[0], row[1], row[2]) for row in found)
    return Inertia(mass, moment, (a, b, c))


def joined(s: Steps, one: Inertia, other: Inertia) -> Inertia:
    """Return the mass properties of two bodies that move together, in one frame."""
    a, b, c = (s.plus(x, y) for x, y in zip(one.matrix, other.matrix, strict=True))
    return Inertia(s(one.mass + other.mass), s.plus(one.moment, other.moment), (a, b, c))
