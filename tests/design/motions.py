"""Motions in closed form, and systems with logs of them."""

from pathlib import Path

import numpy as np

from tests.machines.folders import Array, logs_of, system_of
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Rates of three sines, rad/s.
RATES = (1.3, 3.1, 7.7)


def motion(rates: tuple[float, ...], start: float) -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of a sum of sines, each as large in velocity."""
    t = np.arange(0.0, 6.0, 0.004)
    w, size = np.array(rates)[:, None], 2.0 / len(rates)
    phase = w * t + start * (1.0 + np.arange(len(rates)))[:, None]
    x, v, a = (size / w * np.sin(phase), size * np.cos(phase), -size * w * np.sin(phase))
    return t, x.sum(0), v.sum(0), a.sum(0)


def acceleration_of(rates: tuple[float, ...]) -> float:
    """Root mean square acceleration of the motions that start at 0.2 and at 1.1."""
    return float(np.sqrt(np.mean([motion(rates, start)[3] ** 2 for start in (0.2, 1.1)])))


def read(folder: Path, text: str, logs: list[dict[str, Array]]) -> tuple[System, Logs]:
    """The system and the logs, written to `folder` and read."""
    system = system_of(text, folder)
    return system, logs_of(system, folder, logs)
