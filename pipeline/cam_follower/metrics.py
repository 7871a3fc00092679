"""Errors of simulated trajectories, projected on the angle as in Fig. 6.18."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def project_on_angle(angle: Array, simulated_angle: Array, simulated: Array) -> Array:
    """A simulated signal at the measured angles.

    Args:
        angle: (n,) measured angle, rad.
        simulated_angle: (N,) rad; a backward motion is passed over.
        simulated: (N,) the signal.

    Returns:
        (n,) the simulated signal; zero where the simulation never arrives, as if it stood still.
    """
    forward = np.maximum.accumulate(simulated_angle)
    return np.interp(angle, forward, simulated, right=0.0)


def angle_mse(angle: Array, speed: Array, simulated_angle: Array, simulated_speed: Array) -> float:
    """Mean squared error of the speed over the angle travelled, (rad/s)^2.

    Every sample weighs the angle it covers, so that the slow start does not dominate. No run is left out:
    a simulation that stalls counts with speed zero on all angles that it misses.

    Args:
        angle, speed: (n,) measured, rad and rad/s.
        simulated_angle, simulated_speed: (N,) at any clock.
    """
    weight = np.maximum(np.gradient(np.maximum.accumulate(angle)), 0.0)
    error = project_on_angle(angle, simulated_angle, simulated_speed) - speed
    return float((weight * error**2).sum() / weight.sum())


def time_mse(speed: Array, simulated_speed: Array) -> float:
    """Mean squared error of the speed over time, (rad/s)^2, which also counts drift."""
    n = min(len(speed), len(simulated_speed))
    return float(np.mean((simulated_speed[:n] - speed[:n]) ** 2))
