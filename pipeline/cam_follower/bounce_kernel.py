"""Compiled motion of a follower that leaves its cam and lands on it again (sections 5.2.2 and 5.3).

In flight the follower obeys eq. 5.2 with F = 0. In contact, cam, roller and shaft act like one spring that
returns only a part of the energy of an impact. The spring force is continuous where contact is lost or made,
so that integration steps need not end there.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
import sympy as sp

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.cam import TURN
from pipeline.cam_follower.kernels import compiled_function
from unmodelled.base.arrays import Array, Indices
from unmodelled.base.compiling import kept

#: Relative speed, m/s, below which contact no longer takes energy: the follower settles instead of sticking.
SETTLED = 0.005


class Law(NamedTuple):
    """Parameters of contact and flight in the form of the kernel.

    Attributes:
        loss: loss factor (1 - e^2) / (1 + e^2) of the coefficient of restitution e.
        contact_compliance: compliance of the contact between roller and cam, m/N.
        shaft_compliance: torsional compliance between encoder and cam, rad/(N m).
        guide_coulomb: Coulomb friction b_0 of the guide, N.
        guide_viscous: viscous friction b_1 of the guide, N s/m.
        gravity: gravitational acceleration, m/s^2.
    """

    loss: float
    contact_compliance: float
    shaft_compliance: float
    guide_coulomb: float
    guide_viscous: float
    gravity: float


class Motion(NamedTuple):
    """Measured motion of the cams of several runs."""

    #: (intervals, 4), cubics of the angle (rad) over the time (s) in an interval, highest power first
    pieces: Array
    curves: Array  # (cams, 2, n), displacement h (m) and derivative h' (m/rad) of every cam over one turn
    cam: Indices  # (runs,), number of the cam of every run
    mass: Array  # (runs,), mass of the follower in every run, kg


class Stretches(NamedTuple):
    """Parts of runs to simulate; all arrays are (stretches,)."""

    run: Indices
    piece: Indices  # number of the polynomial of the first interval
    steps: Indices  # number of intervals
    height: Array  # at the start, m
    speed: Array  # at the start, m/s
    first: Indices  # index of the first of the `steps` + 1 result samples


@kept()
def on_cam(curve: Array, angle: float) -> tuple[float, float]:
    """Interpolate displacement (m) and derivative (m/rad) of a cam, from curve (2, n), at an angle (rad)."""
    n = curve.shape[1]
    x = angle * n / TURN
    i = int(np.floor(x))
    f = x - i
    i %= n
    j = i + 1 if i + 1 < n else 0
    return curve[0, i] + f * (curve[0, j] - curve[0, i]), curve[1, i] + f * (curve[1, j] - curve[1, i])


@kept()
def on_cams(curves: Array, cam: Indices, angle: Array) -> Array:
    """Interpolate `curves` (cams, 2, m) for cam (n,), each at its own angle (n,), rad; gives (n, 2)."""
    out = np.empty((len(angle), 2))
    for k in range(len(angle)):
        out[k, 0], out[k, 1] = on_cam(curves[cam[k]], angle[k])
    return out


@kept()
def contact_force(
    height: float, speed: float, h: float, dh: float, omega: float, mass: float, law: Law
) -> float:
    """Return the contact force on the follower, N.

    The force is the weight of the follower where the follower is as high as the cam, and zero where the
    follower is out of reach. The compliance grows with h'^2, because the shaft turns back under the torque h'
    F. The loss adds to the elastic force while the gap closes and reduces it while the gap opens: an impact
    returns the share e^2 of its energy at any speed.

    Takes height in m, speed in m/s, h in m, dh in m/rad, omega in rad/s, mass in kg.
    """
    compliance = law.contact_compliance + law.shaft_compliance * dh * dh
    elastic = (h - height) / compliance + mass * law.gravity
    if elastic <= 0.0:
        return 0.0
    return elastic * (1.0 + law.loss * float(np.tanh((dh * omega - speed) / SETTLED)))


def _follower() -> Callable[..., Any]:
    """Acceleration of the follower, m/s^2, eq. 5.2 and 5.3."""
    speed, force = sp.symbols("v F", real=True)
    friction = physics.guide_friction(speed, sp.tanh(speed / physics.FOLLOWER_CREEP))
    expression = (force - friction) / physics.m - physics.g
    return compiled_function(expression, (speed, force, physics.m, *physics.CONSTANTS))


_equation = _follower()


@numba.njit(inline="always")
def _acceleration(y, v, h, dh, omega, m, law):  # type: ignore[no-untyped-def]
    force = contact_force(y, v, h, dh, omega, m, law)
    return _equation(v, force, m, law.gravity, law.guide_coulomb, law.guide_viscous)


@kept(nogil=True)
def bounced(
    motion: Motion, stretches: Any, law: Law, period: float, substeps: int, eps: Array, force: Array
) -> None:
    """Write the detachment eps (samples,), m, and the contact force, N, at the ends of the intervals."""
    t = period / substeps
    for k in range(len(stretches.run)):
        run, begin, out = stretches.run[k], stretches.piece[k], stretches.first[k]
        curve, m = motion.curves[motion.cam[run]], motion.mass[run]
        y, v = stretches.height[k], stretches.speed[k]
        a, b, w, start = motion.pieces[begin]
        h, dh = on_cam(curve, start)
        eps[out], force[out] = y - h, contact_force(y, v, h, dh, w, m, law)
        for i in range(stretches.steps[k]):
            a, b, c, d = motion.pieces[begin + i]
            for j in range(substeps):
                s = (j + 0.5) * t
                half_w = c + s * (2.0 * b + s * 3.0 * a)
                half_h, half_dh = on_cam(curve, d + s * (c + s * (b + s * a)))
                s = (j + 1.0) * t
                next_w = c + s * (2.0 * b + s * 3.0 * a)
                next_h, next_dh = on_cam(curve, d + s * (c + s * (b + s * a)))
                k1 = _acceleration(y, v, h, dh, w, m, law)
                v2 = v + 0.5 * t * k1
                k2 = _acceleration(y + 0.5 * t * v, v2, half_h, half_dh, half_w, m, law)
                v3 = v + 0.5 * t * k2
                k3 = _acceleration(y + 0.5 * t * v2, v3, half_h, half_dh, half_w, m, law)
                v4 = v + t * k3
                k4 = _acceleration(y + t * v3, v4, next_h, next_dh, next_w, m, law)
                y += t / 6.0 * (v + 2.0 * (v2 + v3) + v4)
                v += t / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
                h, dh, w = next_h, next_dh, next_w
            eps[out + i + 1] = y - h
            force[out + i + 1] = contact_force(y, v, h, dh, w, m, law)
