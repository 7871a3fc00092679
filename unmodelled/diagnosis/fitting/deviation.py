"""Deviations of simulated outputs from measured ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.diagnosis.data.gap import ENOUGH, LARGEST_ERROR, SHARE, SUBSTEPS
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.simulation import Runs, Simulation

#: Steps per sample after which windows that diverge are tried with the finest steps.
PATIENCE = 8


@dataclass(frozen=True)
class Deviation:
    """Deviation of simulated from measured outputs, in standard deviations of the outputs."""

    value: float  # over outputs, windows and samples
    per_output: Mapping[str, float]  # over windows and samples
    per_experiment: Mapping[str, float]  # over outputs and samples, by id

    @classmethod
    def of(cls, recording: Recording, square: Array) -> Deviation:
        """Average square errors (windows, most steps, outputs) over windows and samples."""
        sums = np.einsum("wkj,wk->wj", square, recording.counted)
        logs = recording.logs
        total, count = np.zeros((2, len(logs), len(logs.outputs)))
        np.add.at(total, recording.owner, sums)
        np.add.at(count, recording.owner, recording.compared)
        per_output = np.sqrt(total.sum(0) / np.maximum(count.sum(0), 1.0))
        return cls(
            value=_rms(per_output),
            per_output=dict(zip(logs.outputs, per_output.tolist(), strict=True)),
            per_experiment={
                logs.ids[i]: _rms(np.sqrt(total[i] / np.maximum(count[i], 1.0)))
                for i in recording.runs
                if count[i].any()
            },
        )


def errors(runs: Runs, scale: Array) -> Array:
    """Return errors (windows, most steps, outputs) of the first parameter set, in units of `scale`.

    An error beyond `LARGEST_ERROR` is cut there. At a sample where an output has no finite value, the errors
    of all outputs count as the largest one: a finite output of a simulation that diverged is no prediction.
    """
    error = runs.errors(scale)
    error = np.where(np.isfinite(runs.y[:, 0]).all(axis=-1, keepdims=True), error, np.nan)
    cut = np.copysign(LARGEST_ERROR, np.where(np.isnan(error), 1.0, error))
    return np.where(np.abs(error) <= LARGEST_ERROR, error, cut)


def gap(simulation: Simulation, values: Array, substeps: int = 1) -> Deviation:
    """Return the gap over windows from measured states; values (experiments or 1, 1, numbers), SI."""
    found = errors(simulation(values, substeps=substeps), simulation.recording.scale)
    return Deviation.of(simulation.recording, found**2)


def substeps_needed(
    simulation: Simulation, values: Array, most: int = 32, of_error: float = 0.0
) -> tuple[int, str]:
    """Find the smallest number of integration steps whose error is small against the sensor noise.

    With this number, halving the steps changes no output by more than a tenth of its noise (root mean
    square), or than a share of the error of the model. Windows that still diverge with the finest steps do
    not count. The parameter set `values` has shape (experiments or 1, 1, numbers), SI.
    """
    recording, counted = simulation.recording, simulation.recording.counted
    enough = noise = np.maximum(SHARE * recording.noise / recording.scale, ENOUGH)
    tried = [n for n in SUBSTEPS if n <= most]
    coarse = simulation(values, substeps=tried[0])
    for substeps, more in pairwise(tried):
        fine = simulation(values, substeps=more)
        if of_error > 0.0:
            error = errors(fine, recording.scale)[recording.counted]
            enough = np.maximum(noise, of_error * np.sqrt(np.mean(error**2, axis=0)))
        change = _changes(coarse, fine, recording)
        if more == PATIENCE:
            counted = counted & ~_hopeless(simulation, values, _wild(change, counted), tried)[:, None]
        off = np.sqrt(np.mean(change[counted] ** 2, axis=0)) if counted.any() else np.zeros(len(enough))
        if np.all(off < enough):
            return substeps, ""
        coarse = fine
    worst = int(np.argmax(off / enough))
    return tried[-1], (
        f"the integration has not converged: from {substeps} to {more} steps per sample, "
        f"{recording.logs.outputs[worst]} changes by {off[worst]:.2g} of its standard deviation; "
        f"{enough[worst]:.2g} would be small enough"
    )


def _changes(coarse: Runs, fine: Runs, recording: Recording) -> Array:
    """Changes of outputs by finer steps (windows, most steps, outputs), in standard deviations."""
    with np.errstate(all="ignore"):
        change = np.abs(coarse.y[:, 0] - fine.y[:, 0]) / recording.scale
    return np.where(change <= LARGEST_ERROR, change, LARGEST_ERROR)


def _wild(change: Array, counted: Mask) -> Mask:
    """Windows (windows,) in which an output changes by as much as a change may count."""
    return np.asarray(((change >= LARGEST_ERROR).any(axis=2) & counted).any(axis=1))


def _hopeless(simulation: Simulation, values: Array, wild: Mask, tried: Sequence[int]) -> Mask:
    """Windows (windows,) that the finest steps do not mend: the root of a negative number."""
    if not wild.any() or tried[-1] == PATIENCE:
        return np.zeros_like(wild)
    recording = simulation.recording
    some = replace(recording, start=recording.start[wild], steps=recording.steps[wild])
    coarse, fine = (simulation.over(some)(values, substeps=n) for n in tried[-2:])
    found = np.zeros_like(wild)
    found[wild] = _wild(_changes(coarse, fine, some), some.counted)
    return found


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
