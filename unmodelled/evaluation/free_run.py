"""Free runs in windows back to back along measured experiments: how long they are, and what comes out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.errors import BadInput
from unmodelled.logs.logs import Logs

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Periods; a delay is a whole number of them if it is so close to one.
WHOLE = 1e-6


@dataclass(frozen=True)
class FreeRun:
    """Simulated outputs, row by row beside those of the logs.

    Attributes:
        y: (M, outputs); nan where nothing is simulated, not finite either where the simulation diverged.
        counted: (M, outputs) whether the value is a prediction, and not the start of a simulation or nothing.
        window: (M,) number of the window that ends at or holds the sample, from 0 in every experiment.
    """

    y: Array
    counted: NDArray[np.bool_]
    window: Indices


def steps_of(horizon: float, logs: Logs) -> int:
    """The number of samples closest to `horizon` seconds: at least one, at most the longest experiment.

    Raises:
        BadInput: when `horizon` is not a positive number.
    """
    number = isinstance(horizon, int | float) and not isinstance(horizon, bool)
    if not (number and math.isfinite(horizon) and horizon > 0.0):
        raise BadInput(f"horizon: must be a positive number of seconds, got {horizon}")
    longest = int(np.diff(logs.offsets).max()) - 1
    return max(1, round(min(horizon / logs.period, longest)))
