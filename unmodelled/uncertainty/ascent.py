"""Local maximisation of a log-likelihood."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from unmodelled.base.arrays import Array
from unmodelled.uncertainty.box import Box

#: Log-likelihoods (B,) of a batch of parameters (B, k).
Objective = Callable[[Array], Array]

#: Half the distance, in the unit cube, over which slopes are taken: wide, as the objective may be noisy.
STEP = 3e-4
#: Rise of the log-likelihood that is worth another step.
RISE = 1e-5
#: Edge of the cube for SLSQP, whose first step is the slope: right for a standard error of 1.
STRETCH = 30.0
#: What stands for minus infinity below the start of a climb: line searches interpolate values.
DEEP = 1e3


@dataclass(frozen=True)
class Peak:
    """Highest point found."""

    alpha: Array  # (k,)
    log_likelihood: float


class Recorder:
    """Objective that counts its evaluations and keeps its highest point; what is not finite is -inf."""

    def __init__(self, objective: Objective) -> None:
        self.objective = objective
        self.evaluations = 0
        self.trace: list[float] = []
        self.peak = Peak(np.empty(0), -np.inf)

    def __call__(self, alphas: Array) -> Array:
        raw = np.asarray(self.objective(alphas), float)
        values = np.where(np.isfinite(raw), raw, -np.inf)
        best = int(np.argmax(values))
        if values[best] > self.peak.log_likelihood:
            self.peak = Peak(alphas[best].copy(), float(values[best]))
        self.evaluations += len(alphas)
        self.trace.append(self.peak.log_likelihood)
        return values


def climb(objective: Objective, box: Box, start: Array) -> tuple[Peak, int]:
    """Find the maximum in a box that is nearest to a start (k,), by sequential quadratic programming.

    Slopes are central differences, evaluated in one batch.
    """
    seen, free = Recorder(objective), int(box.free.sum())
    origin = box.clip(start)
    level = float(seen(origin[None])[0])
    if not free or not np.isfinite(level):
        return Peak(origin, level), seen.evaluations

    def falling(place: Array) -> tuple[float, Array]:
        value, slope = _value_and_slope(seen, box, np.clip(place / STRETCH, 0.0, 1.0))
        return -max(value - level, -DEEP), -slope / STRETCH

    # not L-BFGS-B: it wakes the threads of BLAS at every step, which can cost more than all the rest
    minimize(
        falling,
        STRETCH * box.to_unit(origin),
        jac=True,
        method="SLSQP",
        bounds=[(0.0, STRETCH)] * free,
        options={"ftol": RISE},
    )
    return seen.peak, seen.evaluations


def _value_and_slope(objective: Objective, box: Box, unit: Array) -> tuple[float, Array]:
    """Return the log-likelihood and its slopes (free,) in the unit cube; zero beside what is not finite."""
    moves = STEP * np.eye(len(unit))
    ahead, behind = np.minimum(unit + moves, 1.0), np.maximum(unit - moves, 0.0)
    values = objective(box.to_alpha(np.vstack([unit, ahead, behind])))
    above, below = values[1:].reshape(2, -1)
    usable = np.isfinite(above) & np.isfinite(below)
    rise = np.subtract(above, below, out=np.zeros(len(unit)), where=usable)
    return float(values[0]), rise / np.diag(ahead - behind)
