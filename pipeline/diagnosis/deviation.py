"""How far simulated outputs lie from measured ones (shared/contracts/diagnosis.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.diagnosis.recording import Recording
from pipeline.diagnosis.simulation import Simulation
from pipeline.evaluation.gap import ENOUGH, LARGEST_ERROR, SHARE, SUBSTEPS

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


def gap(simulation: Simulation, values: Array, substeps: int = 1) -> Deviation:
    """The gap with `values` (experiments or 1, 1, numbers), from windows that start at the measured states.

    An error beyond `LARGEST_ERROR` standard deviations, or of a simulation that diverged, counts as that.
    """
    runs = simulation(values, substeps=substeps)
    with np.errstate(all="ignore"):
        error = np.abs(runs.y[:, 0] - runs.measured[:, 0]) / simulation.recording.scale
    return Deviation.of(simulation.recording, np.where(error <= LARGEST_ERROR, error, LARGEST_ERROR) ** 2)


def substeps_needed(simulation: Simulation, values: Array, most: int = 8) -> int:
    """Steps per sample with which the integration is as good as the noise of the sensors asks for, see `gap`.

    Args:
        values: (experiments or 1, 1, numbers). most: no more are tried.
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
        if np.all(np.sqrt(np.mean(change**2, axis=0)) < enough):
            return substeps
        coarse = fine
    return tried[-1]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
