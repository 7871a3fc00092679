"""How far simulated outputs lie from measured ones (shared/contracts/diagnosis.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.gap import ENOUGH, LARGEST_ERROR, SHARE, SUBSTEPS
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.simulation import Runs, Simulation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Deviation:
    """Root mean square over windows and samples, in standard deviations of the outputs.

    Attributes:
        value: over outputs too. per_output, per_experiment: the same by name of the output and by id.
    """

    value: float
    per_output: Mapping[str, float]
    per_experiment: Mapping[str, float]

    @classmethod
    def of(cls, recording: Recording, square: Array) -> Deviation:
        """From finite square errors (windows, most steps, outputs); after the end of a window none counts."""
        sums = np.einsum("wkj,wk->wj", square, recording.counted)
        logs = recording.logs
        total, count = np.zeros((len(logs), len(logs.outputs))), np.zeros(len(logs))
        np.add.at(total, recording.owner, sums)
        np.add.at(count, recording.owner, recording.steps)
        per_output = np.sqrt(total.sum(0) / count.sum())
        return cls(
            value=_rms(per_output),
            per_output=dict(zip(logs.outputs, per_output.tolist(), strict=True)),
            per_experiment={logs.ids[i]: _rms(np.sqrt(total[i] / count[i])) for i in recording.runs},
        )


def errors(runs: Runs, scale: Array) -> Array:
    """Return the errors (windows, most steps, outputs) of the first set, in standard deviations of outputs.

    One beyond `LARGEST_ERROR` is cut there, and so are all at a sample where an output has no finite value:
    what shows nothing of a state that diverged is no prediction either.

    Args:
        scale: (outputs,) of a recording.
    """
    error = runs.errors(scale)
    error = np.where(np.isfinite(runs.y[:, 0]).all(axis=-1, keepdims=True), error, np.nan)
    cut = np.copysign(LARGEST_ERROR, np.where(np.isnan(error), 1.0, error))
    return np.where(np.abs(error) <= LARGEST_ERROR, error, cut)


def gap(simulation: Simulation, values: Array, substeps: int = 1) -> Deviation:
    """The gap with `values` (experiments or 1, 1, numbers) over windows that start at the measured states."""
    found = errors(simulation(values, substeps=substeps), simulation.recording.scale)
    return Deviation.of(simulation.recording, found**2)


def substeps_needed(simulation: Simulation, values: Array, most: int = 8) -> tuple[int, str]:
    """Find the steps per sample with which the integration is as good as the noise of the sensors asks for.

    Halving them again changes the outputs by less than a tenth of the sensors' noise.

    Args:
        values: (experiments or 1, 1, numbers). most: no more are tried.

    Returns:
        Their number, and a note if `most` do not suffice, else nothing.
    """
    recording = simulation.recording
    enough = np.maximum(SHARE * recording.noise / recording.scale, ENOUGH)
    tried = [n for n in SUBSTEPS if n <= most]
    coarse = simulation(values, substeps=tried[0]).y[:, 0]
    for substeps, more in pairwise(tried):
        fine = simulation(values, substeps=more).y[:, 0]
        with np.errstate(all="ignore"):
            change = np.abs(coarse - fine)[recording.counted] / recording.scale
        change = np.where(change <= LARGEST_ERROR, change, LARGEST_ERROR)
        off = np.sqrt(np.mean(change**2, axis=0))
        if np.all(off < enough):
            return substeps, ""
        coarse = fine
    worst = int(np.argmax(off / enough))
    return tried[-1], (
        f"the integration has not converged: from {substeps} to {more} steps per sample, "
        f"{recording.logs.outputs[worst]} changes by {off[worst]:.2g} of its standard deviation; "
        f"{enough[worst]:.2g} would be small enough"
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
