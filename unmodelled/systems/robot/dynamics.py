"""Accelerations of the joints of a robot as procedures.

The recursive Newton-Euler algorithm gives the torques without acceleration, the composite-rigid-body
algorithm the mass matrix, and a factorisation that keeps the zeros of a branched tree gives the accelerations
(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5, 6 and 8). Joints that follow another one
have its coordinate: with q = G*y + b, the mass matrix of y is G^T*M*G and its torques are G^T*tau (chapter 3,
explicit constraints). All numbers of the file are folded into the steps; zeros and ones vanish.
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
    """Symbols of one joint."""

    q: sp.Symbol  # angle (rad) or travel (m)
    qd: sp.Symbol  # speed, rad/s or m/s
    torque: sp.Symbol  # sum of the torques (N m) or forces (N) on the joint


@dataclass
class Dynamics:
    """Equations of motion of a robot."""

    robot: Robot
    tree: Tree
    coordinates: Sequence[Coordinates]  # of the joints that move by themselves, as `Tree.leaders`
    value: Value

    def __post_init__(self) -> None:
        self.steps = Steps()
        self._rotations = [self._rotation(k) for k in range(len(self.tree.links))]
        self._own = [of_link(self.steps, self.robot, link, self.value) for link in self.tree.links]

    def accelerations(self) -> list[Procedure]:
        """Return the procedure of the acceleration of each joint that moves by itself."""
        s = self.steps
        bias = self._bias()
        torques = [s(c.torque - b) for c, b in zip(self.coordinates, bias, strict=True)]
        factors, reciprocals = self._factors
        for i, row in reversed(list(enumerate(factors))):
            for j, factor in row.items():
                torques[j] = s(torques[j] - factor * torques[i])
        results = [s(t * r) for t, r in zip(torques, reciprocals, strict=True)]
        for i, row in enumerate(factors):
            for j, factor in row.items():
                results[i] = s(results[i] - factor * results[j])
        return self._procedures(results)

    def mobilities(self) -> list[Procedure]:
        """Return the procedure of the derivative of each acceleration by the torque of its joint.

        These are the diagonal of the inverse of the mass matrix: squares of the inverse of L^T, divided by D.
        """
        s, (factors, reciprocals) = self.steps, self._factors
        results = []
        for k in range(len(factors)):
            column = {k: sp.S.One}
            for i in reversed(range(k + 1)):
                for j, factor in factors[i].items() if i in column else ():
                    column[j] = s(column.get(j, sp.S.Zero) - factor * column[i])
            results.append(s(sp.Add(*(reciprocals[i] * e**2 for i, e in column.items()))))
        return self._procedures(results)

    def _procedures(self, results: list[sp.Expr]) -> list[Procedure]:
        read = {x for e in (*results, *(step for _, step in self.steps.found)) for x in e.free_symbols}
        inputs = sorted(read - {name for name, _ in self.steps.found}, key=str)
        return [Procedure(inputs, self.steps.found, result) for result in results]

    @cached_property
    def _factors(self) -> tuple[list[dict[int, sp.Expr]], list[sp.Expr]]:
        """Rows of L below its diagonal and the reciprocals of D of the mass matrix L^T D L."""
        s, mass = self.steps, self._mass_matrix()
        reciprocals: list[sp.Expr] = [sp.S.One] * len(mass)
        factors: list[dict[int, sp.Expr]] = [{} for _ in mass]
        for k, row in reversed(list(enumerate(mass))):
            reciprocals[k] = s(1 / row.pop(k))
            above = sorted(row, reverse=True)
            for n, i in enumerate(above):
                factors[k][i] = s(row[i] * reciprocals[k])
                for j in above[n:]:
                    mass[i][j] = s(mass[i].get(j, sp.S.Zero) - factors[k][i] * row[j])
        return factors, reciprocals

    def _mass_matrix(self) -> list[dict[int, sp.Expr]]:
        """Rows of the mass matrix of the coordinates up to its diagonal, without zeros."""
        s, links = self.steps, self.tree.links
        found: list[dict[int, sp.Expr]] = [{} for _ in self.coordinates]
        for (k, i), value in self._mass_of_links().items():
            row, column = self._of[k], self._of[i]
            # both (k, i) and (i, k) of the mass matrix of the links
            twice = 2 if k != i and row == column else 1
            part = twice * number(links[k].ratio) * number(links[i].ratio) * value
            row, column = max(row, column), min(row, column)
            if part != 0:
                found[row][column] = s(found[row].get(column, sp.S.Zero) + part)
        return found

    @cached_property
    def _of(self) -> list[int]:
        """Number of the coordinate that moves each link."""
        places = {joint: k for k, joint in enumerate(self.tree.leaders)}
        return [places[link.leader] for link in self.tree.links]

    def _mass_of_links(self) -> dict[tuple[int, int], sp.Expr]:
        """Elements of the mass matrix of all joints: a joint with itself and with each ancestor."""
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
        """Torques of the coordinates without acceleration: gravity, centrifugal and Coriolis forces."""
        links, s = self.tree.links, self.steps
        speeds, turnings, linear, tensors = list[Vector](), list[Vector](), list[Vector](), list[Matrix]()
        for k, link in enumerate(links):
            speed = self._speed(k)
            back = transposed(self._rotations[k])
            p, root = link.parent, link.parent < 0
            if root:
                a = s.times(back, numbers(-self.tree.gravity))
            else:
                a = s.times(back, s.plus(linear[p], s.times(tensors[p], self._origin(k))))
            w = ZERO if root else s.times(back, speeds[p])
            turning = ZERO if root else s.times(back, turnings[p])
            if self._slides(k):
                a = s.vector((a[0] + 2 * w[1] * speed, a[1] - 2 * w[0] * speed, a[2]))
            else:
                turning = s.vector((turning[0] + w[1] * speed, turning[1] - w[0] * speed, turning[2]))
                w = s.vector((w[0], w[1], w[2] + speed))
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
        """Torques of the coordinates, from forces and torques on the links."""
        s, found = self.steps, [sp.S.Zero] * len(self.coordinates)
        for k, link in reversed(list(enumerate(self.tree.links))):
            own = (forces[k] if self._slides(k) else torques[k])[2]
            found[self._of[k]] = s(found[self._of[k]] + number(link.ratio) * own)
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

    def _position(self, k: int) -> sp.Expr:
        """Coordinate of a link, without its offset."""
        return number(self.tree.links[k].ratio) * self.coordinates[self._of[k]].q

    def _speed(self, k: int) -> sp.Expr:
        return number(self.tree.links[k].ratio) * self.coordinates[self._of[k]].qd

    def _slides(self, k: int) -> bool:
        return self.robot.joints[self.tree.links[k].joint].slides

    def _rotation(self, k: int) -> Matrix:
        """Matrix from the frame of a link to its parent's frame."""
        fixed = [numbers(row) for row in self.tree.links[k].placement.rotation]
        if self._slides(k):
            return fixed[0], fixed[1], fixed[2]
        s, angle = self.steps, self._position(k) + _angle(self.tree.links[k].offset)
        c, n = s(sp.cos(angle)), s(sp.sin(angle))
        rows = [s.vector((r[0] * c + r[1] * n, r[1] * c - r[0] * n, r[2])) for r in fixed]
        return rows[0], rows[1], rows[2]

    def _origin(self, k: int) -> Vector:
        """Origin of a link in its parent's frame."""
        link = self.tree.links[k]
        place = numbers(link.placement.position)
        if not self._slides(k):
            return place
        travel = self._position(k) + number(link.offset)
        axis = numbers(link.placement.rotation[:, 2])
        return self.steps.plus(place, (axis[0] * travel, axis[1] * travel, axis[2] * travel))


def _angle(offset: float) -> sp.Expr:
    """A constant angle; quarters of a turn are exact."""
    quarters = offset / (0.5 * math.pi)
    return sp.pi * round(quarters) / 2 if abs(quarters - round(quarters)) < 1e-15 * 4 else number(offset)
