"""Errors of simulated trajectories, projected on the angle (Fig. 6.18)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def project_on_angle(angle: Array, simulated_angle: Array, simulated: Array) -> Array:
    """Interpolate a simulated signal at the measured angles.

    Args:
        angle: measured angle, rad, shape (n,).
        simulated_angle: simulated angle, rad, shape (N,); backward motion is ignored.
        simulated: simulated signal, shape (N,).

    Returns:
        Simulated signal, shape (n,); zero at angles that the simulation does not reach, as at standstill.
    """
    forward = np.maximum.accumulate(simulated_angle)
    return np.interp(angle, forward, simulated, right=0.0)


def angle_mse(angle: Array, speed: Array, simulated_angle: Array, simulated_speed: Array) -> float:
    """Return the mean squared error of the speed over the travelled angle, (rad/s)^2.

    Every sample has the weight of the angle that it covers, so that the slow start does not dominate. All
    runs count: the speed of a stalled simulation is zero at all angles that it does not reach.

    Args:
        angle: measured angle, rad, shape (n,).
        speed: measured speed, rad/s, shape (n,).
        simulated_angle: simulated angle, rad, on any clock, shape (N,).
        simulated_speed: simulated speed, rad/s, shape (N,).
    """
    weight = np.maximum(np.gradient(np.maximum.accumulate(angle)), 0.0)
    error = project_on_angle(angle, simulated_angle, simulated_speed) - speed
    return float((weight * error**2).sum() / weight.sum())


def time_mse(speed: Array, simulated_speed: Array) -> float:
    """Return the mean squared error of the speed over time, which also counts drift, (rad/s)^2.

    Args:
        speed: measured speed, rad/s, shape (n,).
        simulated_speed: simulated speed, rad/s, shape (N,).
    """
    n = min(len(speed), len(simulated_speed))
    return float(np.mean((simulated_speed[:n] - speed[:n]) ** 2))
