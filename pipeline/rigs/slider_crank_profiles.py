"""Torque profiles of the slider-crank bench (section 4.2.2, figure 4.5), ten profiles of 0.4 s.

With T_1 to T_5 the crank stays slow (about 30 rad/s at most); with T_6 to T_10 it reaches 55 to 80 rad/s.
"""

from collections.abc import Callable

import numpy as np

from unmodelled.base.arrays import Array

Profile = Callable[[Array], Array]  # time (s) to torque (N m), of the same shape
_EDGE = 0.002  # duration (s) of a step: a drive limits the rate of its torque


def _line(*points: tuple[float, float]) -> Profile:
    """Ramps from point to point (s, N m)."""
    times, torques = zip(*points, strict=True)
    return lambda t: np.interp(t, times, torques)


def _steps(*levels: tuple[float, float]) -> Profile:
    """Torque levels (N m), each from its own instant (s) on; nothing before the first."""
    before = [0.0, *(torque for _, torque in levels)]
    edges = [
        ((start, low), (start + _EDGE, high)) for (start, high), low in zip(levels, before, strict=False)
    ]
    return _line(*(point for edge in edges for point in edge))


def _sines(*waves: tuple[float, float, float]) -> Profile:
    """Sum of sines (amplitude N m, frequency Hz, phase rad)."""
    return lambda t: np.sum([a * np.sin(2 * np.pi * f * t + phase) for a, f, phase in waves], axis=0)


def _chirp(amplitude: float, first: float, sweep: float) -> Profile:
    """Sine whose frequency rises from `first` (Hz) by `sweep` (Hz/s)."""
    return lambda t: amplitude * np.sin(2 * np.pi * (first + 0.5 * sweep * t) * t)


PROFILES: tuple[Profile, ...] = (
    _steps((0.0, -0.4), (0.13, 0.8)),
    _line((0.0, 1.5), (0.19, -1.7), (0.4, 0.5)),
    _sines((-2.0, 4.3, 0.0)),
    _steps((0.0, 0.7), (0.08, -0.1), (0.16, 1.2), (0.24, -0.4), (0.32, 0.7)),
    _sines((1.4, 2.4, 2.1), (0.9, 8.3, 1.4), (0.8, 15.8, 0.2)),
    _steps((0.0, 2.7), (0.16, -1.4)),
    _line((0.0, -3.4), (0.14, 3.7), (0.4, -1.1)),
    _chirp(-3.5, 1.4, 12.1),
    _steps(*((0.05 * k, torque) for k, torque in enumerate((-1.6, -3.8, 3.1, -1.7, 0.0, -3.2, -2.9, 1.4)))),
    _sines((3.3, 2.9, 0.2), (2.5, 6.7, 1.5), (1.9, 14.9, 5.0)),
)
