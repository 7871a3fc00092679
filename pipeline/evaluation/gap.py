"""The gap between a system and measured experiments (shared/contracts/diagnosis.md)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.evaluation.free_run import FreeRun, free_run, steps_of
from pipeline.measurements.logs import Logs
from pipeline.models.nnap import Integration
from pipeline.numerics.differentiate import noise
from pipeline.physics.system.model import System

Array = NDArray[np.float64]

#: Standard deviations of an output; a larger error, or that of a simulation that diverged, counts as this.
LARGEST_ERROR = 10.0
#: Steps per sample that are tried.
SUBSTEPS = (1, 2, 4, 8, 16, 32, 64)
#: The error of integration, as a share of the noise floor, and what is enough without noise.
SHARE, ENOUGH = 0.1, 1e-7


@dataclass(frozen=True)
class Gap:
    """How far free runs lie from measured outputs, in standard deviations of the outputs.

    Attributes:
        value: root mean square over outputs, windows and samples; the first sample of an experiment, which
            is no prediction, does not count.
        per_experiment, per_output: the same by id and by name of the output.
        floor: what the noise of the sensors alone leaves, see `noise_floor`; root mean square over outputs.
        scale: standard deviation of every output over the experiments, in its unit.
        substeps: integration steps per sample.
        run: the simulated outputs; an error beyond `LARGEST_ERROR` is cut there.
        notes: what a reader of the number must know.
    """

    value: float
    per_experiment: Mapping[str, float]
    per_output: Mapping[str, float]
    floor: float
    scale: Mapping[str, float]
    substeps: int
    run: FreeRun
    notes: tuple[str, ...]


def gap(system: System, logs: Logs, horizon: float, runs: Sequence[int] | None = None) -> Gap:
    """Compare free runs of `horizon` seconds with the measured outputs.

    The integration is by Runge and Kutta's method of order four, inputs run straight from sample to sample,
    and steps are halved until halving them again changes the outputs by less than a tenth of the noise floor.

    Args:
        system: with its values of the parameters, laws of its ports included.
        logs: with the states of `system`, see `Logs.for_system`.
        horizon: s, rounded to samples. runs: which experiments; all unless given.

    Raises:
        BadInput: when the horizon is not positive, or a delay is as long as an experiment.
    """
    runs = range(len(logs)) if runs is None else runs
    scale, floor = output_scale(logs, runs), noise_floor(logs, runs)
    run, substeps, notes = _converged(system, logs, horizon, runs, scale, floor)
    error = (run.y - logs.y) / scale
    beyond = run.counted & ~(np.abs(error) <= LARGEST_ERROR)
    error[beyond] = np.copysign(LARGEST_ERROR, error[beyond])
    run = replace(run, y=np.where(beyond, logs.y + scale * error, run.y))
    square = np.where(run.counted, error**2, np.nan)
    per_output = np.sqrt(np.nanmean(square, axis=0))
    return Gap(
        value=_rms(per_output),
        per_experiment={logs.ids[i]: _rms(np.sqrt(np.nanmean(square[logs.rows(i)], axis=0))) for i in runs},
        per_output=dict(zip(logs.outputs, per_output.tolist(), strict=True)),
        floor=_rms(floor),
        scale=dict(zip(logs.outputs, scale.tolist(), strict=True)),
        substeps=substeps,
        run=run,
        notes=(*_about_horizon(logs, horizon, runs), *_about_errors(logs, run, beyond), *notes),
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def output_scale(logs: Logs, runs: Sequence[int]) -> Array:
    """Standard deviation of every output over the experiments `runs`, (outputs,), in its unit."""
    return np.asarray(np.std(np.concatenate([logs.y[logs.rows(i)] for i in runs]), axis=0))


def noise_floor(logs: Logs, runs: Sequence[int]) -> Array:
    """What the noise of each output leaves of its error, (outputs,), in standard deviations of the output.

    The estimate is from the outputs' own samples. A window that starts at noisy states passes their noise on,
    so that a system without any fault lies somewhat above this floor.
    """
    square = [[noise(column) ** 2 for column in logs.y[logs.rows(i)].T] for i in runs]
    return np.asarray(np.sqrt(np.mean(square, axis=0)) / output_scale(logs, runs))


def _converged(
    system: System, logs: Logs, horizon: float, runs: Sequence[int], scale: Array, floor: Array
) -> tuple[FreeRun, int, list[str]]:
    """A free run with the fewest substeps that suffice, their number, and a note if the most do not."""
    enough = np.maximum(SHARE * floor, ENOUGH)
    run = free_run(system, logs, horizon, _integration(logs, SUBSTEPS[0]), runs)
    for substeps, more in pairwise(SUBSTEPS):
        finer = free_run(system, logs, horizon, _integration(logs, more), runs)
        change = _change(run, finer, scale)
        if np.all(change < enough):
            return run, substeps, []
        run = finer
    worst = int(np.argmax(change / enough))
    note = (
        f"the integration has not converged: from {substeps} to {more} steps per sample, "
        f"{logs.outputs[worst]} changes by {change[worst]:.2g} of its standard deviation; "
        f"{enough[worst]:.2g} would be small enough"
    )
    return run, more, [note]


def _integration(logs: Logs, substeps: int) -> Integration:
    return Integration(logs.period, "rk4", substeps, 1.0)


def _change(coarse: FreeRun, fine: FreeRun, scale: Array) -> Array:
    """Root mean square difference of every output; a diverged sample always counts as far off."""
    with np.errstate(all="ignore"):
        difference = np.abs(coarse.y - fine.y) / scale
    difference = np.where(difference <= LARGEST_ERROR, difference, LARGEST_ERROR)
    return np.asarray(np.sqrt(np.nanmean(np.where(coarse.counted, difference**2, np.nan), axis=0)))


def _about_horizon(logs: Logs, horizon: float, runs: Sequence[int]) -> list[str]:
    seconds = steps_of(horizon, logs) * logs.period
    if horizon > max(float(np.diff(logs.offsets)[i]) for i in runs) * logs.period:
        return [f"the horizon of {horizon:g} s is longer than every experiment: each is simulated as a whole"]
    if abs(seconds - horizon) > 0.01 * horizon:
        samples = f"a whole number of samples, {seconds / logs.period:.0f} of {logs.period:g} s"
        return [f"the horizon of {horizon:g} s was rounded to {samples}"]
    return []


def _about_errors(logs: Logs, run: FreeRun, beyond: NDArray[np.bool_]) -> list[str]:
    return [
        f"{name}: {count} of {total} simulated samples diverged or lie more than {LARGEST_ERROR:g} standard "
        f"deviations off, and count as {LARGEST_ERROR:g}"
        for name, count, total in zip(logs.outputs, beyond.sum(0), run.counted.sum(0), strict=True)
        if count
    ]
