"""Efficiency of a separately excited DC motor in steady state: the two-parameter model of Fig. 2.4a."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def efficiency(current: Array, voltage: float, resistance: float, friction: float) -> Array:
    """Mechanical power by electrical power.

    With E_a = V - R_a I, omega = E_a / K and T = K I the power (T - B omega) omega is E_a (I - B' E_a), where
    B' = B / K^2: the motor constant drops out.

    Args:
        current: I, A. voltage: V. resistance: R_a, Ohm. friction: the scaled coefficient B', A/V.
    """
    emf = voltage - resistance * current
    return np.asarray(emf * (current - friction * emf) / (voltage * current))
