"""Efficiency of a separately excited DC motor in steady state, with two parameters (Fig. 2.4a)."""

from __future__ import annotations

import numpy as np

from pipeline.arrays import Array


def efficiency(current: Array, voltage: float, resistance: float, friction: float) -> Array:
    """Return the ratio of mechanical to electrical power.

    With E_a = V - R_a I, omega = E_a / K and T = K I, the mechanical power (T - B omega) omega is E_a (I - B'
    E_a) with B' = B / K^2, independent of the motor constant K.

    Takes current (n,) in A, voltage in V, resistance in Ohm, friction in A/V; gives (n,).
    """
    emf = voltage - resistance * current
    return np.asarray(emf * (current - friction * emf) / (voltage * current))
