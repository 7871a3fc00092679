"""Inputs as they act: logged ones after their delays."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.logs.clock import shifted
from unmodelled.systems.model import System

Array = NDArray[np.float64]


def acting(
    system: System,
    ids: Sequence[str],
    u: Array,
    offsets: NDArray[np.int64],
    period: float,
    delays: Sequence[float],
) -> Array:
    """Inputs `delays` later (earlier where negative), straight between samples and held beyond the ends.

    Args:
        system: whose inputs. ids: of the n experiments.
        u: (M, inputs). offsets: (n + 1,). period: s. delays: (inputs,) s.

    Raises:
        BadInput: when a delay is as long as an experiment.
    """
    late = u.copy()
    shortest = int(np.argmin(np.diff(offsets)))
    for j, delay in enumerate(delays):
        if abs(delay) >= period * (np.diff(offsets)[shortest] - 1):
            raise BadInput(
                f"system {system.name}: inputs.{system.inputs[j].name}.delay: {delay:g} s is too long for "
                f"experiment {ids[shortest]} of {period * (np.diff(offsets)[shortest] - 1):g} s"
            )
        if delay != 0.0:
            for a, b in pairwise(offsets):
                late[a:b, j] = shifted(u[a:b, j], period, -delay, "linear")
    return late
