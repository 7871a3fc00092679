"""Compiled free runs of the motor drivetrain, with errors projected on the angle."""

from typing import Any

import numba
import numpy as np

from pipeline.cam_follower import cam_follower as physics
from pipeline.cam_follower.cam import TURN
from pipeline.cam_follower.integrate import SPEED_LIMIT
from pipeline.cam_follower.kernels import compiled_function
from unmodelled.base.compiling import compiled

_SYMBOLS = (physics.T_d, physics.theta, physics.omega, physics.dh, physics.d2h, physics.m, physics.V)
_equation = compiled_function(
    physics.MOTOR_ACCELERATION,
    (*_SYMBOLS, *physics.CAM_CONSTANTS, *physics.MOTOR_PARAMETERS, *physics.CONSTANTS),
)


@numba.njit(error_model="numpy", inline="always")
def _acceleration(a: float, w: float, curve: Any, V: float, m: float, own: Any, p: Any, c: Any) -> float:
    n = curve.shape[1]
    x = a * n / TURN
    i = int(np.floor(x))
    f = x - i
    i %= n
    j = i + 1 if i + 1 < n else 0
    dh = curve[0, i] + (curve[0, j] - curve[0, i]) * f
    d2h = curve[1, i] + (curve[1, j] - curve[1, i]) * f
    return _equation(  # type: ignore[no-any-return]
        0.0, a, w, dh, d2h, m, V, own[0], own[1], own[2],
        p[0], p[1], p[2], p[3], p[4], p[5], c[0], c[1], c[2],
    )  # fmt: skip


# not parallel: numba would give OpenMP, and with it torch, as many threads as there are cores
@compiled
def residual(
    p: Any, c: Any, curves: Any, theta: Any, omega: Any, lengths: Any, V: Any, m: Any, cam: Any, own: Any,
    period: float, substeps: int, stretch: float, out: Any,
) -> None:  # fmt: skip
    """Write the simulated minus the measured speed at every measured angle, rad/s, into `out`.

    At angles that a simulation does not reach within `stretch` times the measured duration, the simulated
    speed counts as zero.

    Takes p (6,), c (3,), curves (cams, 2, n), theta (runs, samples), omega (same shape), V in V, m in kg, own
    (runs, 3), period in s, out (runs, samples) in rad/s.
    """
    h = period / substeps
    for r in range(len(lengths)):
        curve, o = curves[cam[r]], own[r]
        a, w, seen = theta[r, 0], omega[r, 0], 0
        a_old, w_old = a, w
        for _ in range(int(lengths[r] * stretch) * substeps):
            while seen < lengths[r] and theta[r, seen] <= a:
                f = (theta[r, seen] - a_old) / (a - a_old) if a > a_old else 1.0
                out[r, seen] = w_old + (w - w_old) * max(f, 0.0) - omega[r, seen]
                seen += 1
            if seen == lengths[r] or not abs(w) < SPEED_LIMIT:
                break
            a_old, w_old = a, w
            k1 = _acceleration(a, w, curve, V[r], m[r], o, p, c)
            w2 = w + 0.5 * h * k1
            k2 = _acceleration(a + 0.5 * h * w, w2, curve, V[r], m[r], o, p, c)
            w3 = w + 0.5 * h * k2
            k3 = _acceleration(a + 0.5 * h * w2, w3, curve, V[r], m[r], o, p, c)
            w4 = w + h * k3
            k4 = _acceleration(a + h * w3, w4, curve, V[r], m[r], o, p, c)
            a += h / 6.0 * (w + 2.0 * (w2 + w3) + w4)
            w += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
        for k in range(seen, lengths[r]):
            out[r, k] = -omega[r, k]
