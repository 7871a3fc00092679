"""Accelerations of the joints of a robot as procedures.

The recursive Newton-Euler algorithm gives the torques without acceleration, the composite-rigid-body
algorithm the mass matrix, and a factorisation that keeps the zeros of a branched tree gives the accelerations
(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5, 6 and 8). All numbers of the file are
folded into the steps; zeros and ones vanish.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from unmodelled.systems.procedure import Procedure
from unmodelled.systems.robot.bodies import Robot
from unmodelled.systems.robot.inertia import Value, joined, moved, of_link
from unmodelled.systems.robot.links import Tree
from unmodelled.systems.robot.spatial import ZERO, Matrix, Steps, Vector, number, numbers, transposed


@dataclass(frozen=True)
class Coordinates:
    """Symbols of one joint.

    Attributes:
        q: angle (rad) or travel (m).
        qd: speed, rad/s or m/s.
        torque: sum of the torques (N m) or forces (N) on the joint.
    """

    q: sp.Symbol
    qd: sp.Symbol
    torque: sp.Symbol


@dataclass
class Dynamics:
    """Equations of motion of a robot.

    Attributes:
        robot: bodies and joints.
        tree: moving links.
        coordinates: symbols of the joint of each link, in the order of the links.
        value: value of a property of the file.
    """

    robot: Robot
    tree: Tree
    coordinates: Sequence[Coordinates]
    value: Value

    def __post_init__(self) -> None:
        self.steps = Steps()
        self._rotations = [self._rotation(k) for k in range(len(self.tree.links))]
        self._own = [of_link(self.steps, self.robot, link, self.value) for link in self.tree.links]

    def accelerations(self) -> list[Procedure]:
        """Return the procedure of the acceleration of each link's joint."""
        s, links = self.steps, self.tree.links
        bias = self._bias()
        torques = [s(c.torque - b) for c, b in zip(self.coordinates, bias, strict=True)]
        factors, reciprocals = self._factors
        for i in reversed(range(len(links))):
            for j in self._ancestors(i):
                torques[j] = s(torques[j] - factors[i, j] * torques[i])
        results = [s(t * r) for t, r in zip(torques, reciprocals, strict=True)]
        for i in range(len(links)):
            for j in self._ancestors(i):
                results[i] = s(results[i] - factors[i, j] * results[j])
        read = {x for e in (*results, *(step for _, step in s.found)) for x in e.free_symbols}
        inputs = sorted(read - {name for name, _ in s.found}, key=str)
        return [Procedure(inputs, s.found, result) for result in results]

    def _ancestors(self, i: int) -> list[int]:
        found = []
        while (i := self.tree.links[i].parent) >= 0:
            found.append(i)
        return found

    @cached_property
    def _factors(self) -> tuple[dict[tuple[int, int], sp.Expr], list[sp.Expr]]:
        """L and the reciprocals of D of the mass matrix L^T D L."""
        s, mass = self.steps, self._mass_matrix()
        reciprocals: list[sp.Expr] = [sp.S.One] * len(self.tree.links)
        factors = {}
        for k in reversed(range(len(self.tree.links))):
            reciprocals[k] = s(1 / mass[k, k])
            above = self._ancestors(k)
            for n, i in enumerate(above):
                factors[k, i] = s(mass[k, i] * reciprocals[k])
                for j in above[n:]:
                    mass[i, j] = s(mass[i, j] - factors[k, i] * mass[k, j])
        return factors, reciprocals

    def _mass_matrix(self) -> dict[tuple[int, int], sp.Expr]:
        """Elements of the mass matrix: a joint with itself and with each ancestor."""
        links, s = self.tree.links, self.steps
        whole = [*self._own]
        mass = {}
        for k in reversed(range(len(links))):
            link, inertia = links[k], whole[k]
            if link.parent >= 0:
                carried = moved(s, inertia, self._rotations[k], self._origin(k))
                whole[link.parent] = joined(s, whole[link.parent], carried)
            joint = self.robot.joints[link.joint]
            armature = self.value(joint.name, "armature", joint.armature)
            h = inertia.moment
            if joint.slides:
                force, torque = (sp.S.Zero, sp.S.Zero, inertia.mass), (h[1], -h[0], sp.S.Zero)
                mass[k, k] = s(inertia.mass + armature)
            else:
                force, torque = (-h[1], h[0], sp.S.Zero), transposed(inertia.matrix)[2]
                mass[k, k] = s(inertia.matrix[2][2] + armature)
            i = k
            while (parent := links[i].parent) >= 0:
                force = s.times(self._rotations[i], force)
                torque = s.plus(s.times(self._rotations[i], torque), s.cross(self._origin(i), force))
                i = parent
                mass[k, i] = (force if self._slides(i) else torque)[2]
        return mass

    def _bias(self) -> list[sp.Expr]:
        """Torques of the joints without acceleration: gravity, centrifugal and Coriolis forces."""
        links, s = self.tree.links, self.steps
        speeds, turnings, linear, tensors = list[Vector](), list[Vector](), list[Vector](), list[Matrix]()
        for k, link in enumerate(links):
            c = self.coordinates[k]
            back = transposed(self._rotations[k])
            p, root = link.parent, link.parent < 0
            if root:
                a = s.times(back, numbers(-self.tree.gravity))
            else:
                a = s.times(back, s.plus(linear[p], s.times(tensors[p], self._origin(k))))
            w = ZERO if root else s.times(back, speeds[p])
            turning = ZERO if root else s.times(back, turnings[p])
            if self._slides(k):
                a = s.vector((a[0] + 2 * w[1] * c.qd, a[1] - 2 * w[0] * c.qd, a[2]))
            else:
                turning = s.vector((turning[0] + w[1] * c.qd, turning[1] - w[0] * c.qd, turning[2]))
                w = s.vector((w[0], w[1], w[2] + c.qd))
            speeds.append(w)
            linear.append(a)
            turnings.append(turning)
            tensors.append(self._tensor(w, turning))
        forces, torques = [], []
        for k in range(len(links)):
            own = self._own[k]
            h, w, turning = own.moment, speeds[k], turnings[k]
            inner = [own.mass * x for x in linear[k]]
            forces.append(s.plus(s.vector(inner), s.times(tensors[k], h)))
            spin = s.times(own.matrix, w)
            torques.append(s.plus(s.cross(h, linear[k]), s.times(own.matrix, turning), s.cross(w, spin)))
        return self._collected(forces, torques)

    def _collected(self, forces: list[Vector], torques: list[Vector]) -> list[sp.Expr]:
        """Torques of the joints, from forces and torques on the links."""
        s, found = self.steps, [sp.S.Zero] * len(forces)
        for k, link in reversed(list(enumerate(self.tree.links))):
            found[k] = (forces[k] if self._slides(k) else torques[k])[2]
            if link.parent >= 0:
                force = s.times(self._rotations[k], forces[k])
                arm = s.cross(self._origin(k), force)
                forces[link.parent] = s.plus(forces[link.parent], force)
                torques[link.parent] = s.plus(
                    torques[link.parent], s.times(self._rotations[k], torques[k]), arm
                )
        return found

    def _tensor(self, w: Vector, turning: Vector) -> Matrix:
        """Matrix that gives the acceleration of a point relative to the origin from its position."""
        s = self.steps
        xx, yy, zz = (s(x * x) for x in w)
        xy, xz, yz = s(w[0] * w[1]), s(w[0] * w[2]), s(w[1] * w[2])
        return (
            s.vector((-yy - zz, xy - turning[2], xz + turning[1])),
            s.vector((xy + turning[2], -xx - zz, yz - turning[0])),
            s.vector((xz - turning[1], yz + turning[0], -xx - yy)),
        )

    def _slides(self, k: int) -> bool:
        return self.robot.joints[self.tree.links[k].joint].slides

    def _rotation(self, k: int) -> Matrix:
        """Matrix from the frame of a link to its parent's frame."""
        fixed = [numbers(row) for row in self.tree.links[k].placement.rotation]
        if self._slides(k):
            return fixed[0], fixed[1], fixed[2]
        s, angle = self.steps, self.coordinates[k].q + _angle(self.tree.links[k].offset)
        c, n = s(sp.cos(angle)), s(sp.sin(angle))
        rows = [s.vector((r[0] * c + r[1] * n, r[1] * c - r[0] * n, r[2])) for r in fixed]
        return rows[0], rows[1], rows[2]

    def _origin(self, k: int) -> Vector:
        """Origin of a link in its parent's frame."""
        link = self.tree.links[k]
        place = numbers(link.placement.position)
        if not self._slides(k):
            return place
        travel = self.coordinates[k].q + number(link.offset)
        axis = numbers(link.placement.rotation[:, 2])
        return self.steps.plus(place, (axis[0] * travel, axis[1] * travel, axis[2] * travel))


def _angle(offset: float) -> sp.Expr:
    """A constant angle; quarters of a turn are exact."""
    quarters = offset / (0.5 * math.pi)
    return sp.pi * round(quarters) / 2 if abs(quarters - round(quarters)) < 1e-15 * 4 else number(offset)
