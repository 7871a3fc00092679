"""The definition of the gap between a system and measured experiments.

`unmodelled.diagnosis.fitting.free_runs` computes it, for every verb.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.base.errors import BadInput
from unmodelled.base.wording import amounts
from unmodelled.logs.logs import Logs
from unmodelled.systems.units import LoggedUnit

#: Periods; a delay is a whole number of them if it is so close to one.
WHOLE = 1e-6
#: Standard deviations of an output; a larger error, or that of a simulation that diverged, counts as this.
LARGEST_ERROR = 10.0
#: Share of the motion below which an error does not matter.
MATTERS = 0.02
#: Standard deviations of an output; a whole run that is further off has diverged.
DIVERGED = 1e3
#: Steps per sample that are tried.
SUBSTEPS = (1, 2, 4, 8, 16, 32, 64)
#: The error of integration, as a share of the noise floor, and what is enough without noise.
SHARE, ENOUGH = 0.1, 1e-7
#: A run whose standard deviation is so many times that of the median run counts as this many times only.
WILD = 10.0
#: Share of the magnitude below which a deviation is rounding.
ROUNDING = 1e-12


@dataclass(frozen=True)
class FreeRun:
    """Simulated outputs, row by row beside the measured ones."""

    #: (samples, outputs), in their units; nan where nothing is simulated, not finite where it diverged.
    y: Array
    counted: Mask  # (samples, outputs): a prediction, not the start of a simulation or nothing
    window: Indices  # window that ends at or holds the sample, from 0 in every experiment, (samples,)


@dataclass(frozen=True)
class Off:
    """Root mean square errors of an output in its unit; None where the simulation diverges."""

    unit: str
    #: At the last sample of the windows; shorter windows count where an experiment has no other.
    at_horizon: float | None
    whole_run: float | None  # over experiments that are simulated from their first state to their end
    column: LoggedUnit | None = None  # in which differences of the output's column are written; None: `unit`

    @property
    def as_logged(self) -> Off:
        """Return the errors in the unit of the output's column, K for degC."""
        if self.column is None:
            return self
        factor = self.column.factor
        near, far = (e if e is None else e / factor for e in (self.at_horizon, self.whole_run))
        return Off(self.column.text, near, far)

    def says(self, seconds: float) -> str:
        """Say both errors in words, with the horizon in s.

        Examples:
            >>> Off("rad", 0.0123, None).says(0.1)
            '12 mrad off after 0.1 s, diverges over whole runs'
        """
        shown, late = self.as_logged, amounts([seconds], "s", 3)[0].replace("\u00a0", " ")
        near, far = (_amount(value, shown.unit) for value in (shown.at_horizon, shown.whole_run))
        return ", ".join(
            (
                f"{near} off after {late}" if near else f"diverges within {late}",
                f"{far} over whole runs" if far else "diverges over whole runs",
            )
        )


def _amount(value: float | None, unit: str) -> str:
    """Return a value with its unit, "" for no value."""
    return "" if value is None else amounts([value], unit)[0].replace("\u00a0", " ")


@dataclass(frozen=True)
class Gap:
    """Distance of free runs from measured outputs, in standard deviations of the outputs."""

    value: float  # root mean square over outputs, windows and samples that are predictions
    per_experiment: Mapping[str, float]  # by id
    per_output: Mapping[str, float]  # by name
    floor: float  # what the noise of the sensors, also in the starts of windows, alone would leave
    floors: Mapping[str, float]  # by id of the experiment
    persistence: float  # error over the same windows, see `unmodelled.diagnosis.data.persistence`
    scale: Mapping[str, float]  # standard deviation by name of the output, in its unit
    units: Mapping[str, Off]  # by name of the output
    substeps: int  # integration steps per sample
    run: FreeRun  # an error beyond `LARGEST_ERROR` is cut there
    notes: tuple[str, ...]  # on horizon, integration and diverged simulations, a sentence each


def output_scale(logs: Logs) -> Array:
    """Return the standard deviation (outputs,) of every output within the experiments.

    The deviation is that from the mean of each experiment, pooled over all samples of all experiments,
    whichever of them are simulated: an offset of one experiment does not change it. No experiment counts with
    more than `WILD` times the median experiment's. An output that is constant within every experiment has the
    largest magnitude it takes as its scale, and 1 if it is always zero.
    """
    each = np.array([_within(logs.y[logs.rows(i)]) for i in range(len(logs))])
    usual = np.median(each, axis=0)
    each = np.where(usual > 0.0, np.minimum(each, WILD * usual), each)
    largest = np.max(each, axis=0)
    unit = np.where(largest > 0.0, largest, 1.0)  # squares of small numbers are zero, of large ones infinite
    weight = np.diff(logs.offsets) / logs.offsets[-1]
    pooled = unit * np.sqrt(weight @ (each / unit) ** 2)
    magnitude = np.max(np.abs(logs.y), axis=0)
    return np.asarray(np.where(largest > 0.0, pooled, np.where(magnitude > 0.0, magnitude, 1.0)))


def _within(y: Array) -> Array:
    """Standard deviation of the samples (samples, outputs) of one experiment; 0 where it is rounding."""
    off = y - np.mean(y, axis=0)
    largest = np.max(np.abs(off), axis=0)
    moving = largest > ROUNDING * np.max(np.abs(y), axis=0)
    unit = np.where(moving, largest, 1.0)
    return np.where(moving, unit * np.sqrt(np.mean((off / unit) ** 2, axis=0)), 0.0)


def steps_of(horizon: float, logs: Logs) -> int:
    """Return the number of samples closest to a horizon, s: at least one, at most the longest experiment."""
    number = isinstance(horizon, int | float) and not isinstance(horizon, bool)
    if not (number and math.isfinite(horizon) and horizon > 0.0):
        raise BadInput(f"horizon: must be a positive number of seconds, got {horizon}")
    longest = int(np.diff(logs.offsets).max()) - 1
    return max(1, round(min(horizon / logs.period, longest)))


def shrink(reidentified: float, model: float, floor: float) -> float:
    """Return the share of the squared gap above the noise floor that a model explains, from 0 to 1.

    Examples:
        >>> shrink(0.5, 0.3, 0.1)
        0.66...
    """
    whole = reidentified**2 - floor**2
    return min(1.0, max(0.0, (reidentified**2 - model**2) / whole)) if whole > 0.0 else 0.0
