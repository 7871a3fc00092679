"""Motions in closed form, and systems with logs of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.machines.folders import logs_of, system_of
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Array = NDArray[np.float64]


def motion(rates: tuple[float, ...], start: float) -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of a sum of sines, each as large in velocity."""
    t = np.arange(0.0, 6.0, 0.004)
    phases = [(w, w * t + start * (i + 1)) for i, w in enumerate(rates)]
    size = 2.0 / len(rates)
    return (
        t,
        sum(size / w * np.sin(a) for w, a in phases) + np.zeros_like(t),
        sum(size * np.cos(a) for w, a in phases) + np.zeros_like(t),
        sum(-size * w * np.sin(a) for w, a in phases) + np.zeros_like(t),
    )


def read(folder: Path, text: str, logs: list[dict[str, Array]]) -> tuple[System, Logs]:
    """The system and the logs, written to `folder` and read."""
    system = system_of(text, folder)
    return system, logs_of(system, folder, logs)
