"""Errors of simulated trajectories, projected on the angle (Fig. 6.18)."""

import numpy as np

from unmodelled.base.arrays import Array


def project_on_angle(angle: Array, simulated_angle: Array, simulated: Array) -> Array:
    """Interpolate a simulated signal (N,) at the measured angles (n,), rad."""
    forward = np.maximum.accumulate(simulated_angle)
    return np.interp(angle, forward, simulated, right=0.0)


def angle_mse(angle: Array, speed: Array, simulated_angle: Array, simulated_speed: Array) -> float:
    """Return the mean squared error of the speed over the travelled angle, (rad/s)^2.

    Every sample has the weight of the angle that it covers, so that the slow start does not dominate. All
    runs count: the speed of a stalled simulation is zero at all angles that it does not reach.

    Takes angle (n,) in rad, speed (n,) in rad/s, simulated_angle (N,), simulated_speed (N,) in rad/s.
    """
    weight = np.maximum(np.gradient(np.maximum.accumulate(angle)), 0.0)
    error = project_on_angle(angle, simulated_angle, simulated_speed) - speed
    return float((weight * error**2).sum() / weight.sum())


def time_mse(speed: Array, simulated_speed: Array) -> float:
    """Return the mean squared error of the speed (n,) over time, (rad/s)^2, which also counts drift."""
    n = min(len(speed), len(simulated_speed))
    return float(np.mean((simulated_speed[:n] - speed[:n]) ** 2))
