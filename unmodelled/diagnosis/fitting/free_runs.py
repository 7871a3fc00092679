"""The gap of a system by its free runs on the expression machine, for every verb that reports one."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.data.gap import (
    DIVERGED,
    LARGEST_ERROR,
    SUBSTEPS,
    WHOLE,
    FreeRun,
    Gap,
    Off,
    steps_of,
)
from unmodelled.diagnosis.data.persistence import persistence
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.fitting.deviation import Deviation, errors, substeps_needed
from unmodelled.diagnosis.fitting.floor import floor
from unmodelled.diagnosis.fitting.simulation import MakeBackend, Runs, Simulation
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System


def free_runs(
    system: System,
    logs: Logs,
    horizon: float,
    runs: Sequence[int] | None = None,
    sensors: Sensors | None = None,
) -> Gap:
    """Compare free runs of `horizon` seconds with the measured outputs.

    The integration is by Runge and Kutta's method of order four, inputs run straight between samples unless
    the system holds them, and steps are halved until halving them again changes no output by more than a
    tenth of its sensor noise.
    """
    if logs.states != tuple(s.name for s in system.states):
        raise ValueError(f"logs must have the states of {system.name}, see prepare")
    runs = tuple(range(len(logs)) if runs is None else runs)
    latest = _latest(system, logs, runs)
    recording = Recording.of(logs, horizon, runs, latest, sensors)
    simulation = Simulation(system, recording)
    values = simulation.values[None, None]
    substeps, unconverged = substeps_needed(simulation, values, SUBSTEPS[-1])
    found = simulation(values, substeps=substeps)
    error = errors(found, recording.scale)
    deviation, least = Deviation.of(recording, error**2), floor(simulation, values, substeps)
    without_model = persistence(recording)
    whole = Recording.whole(logs, runs, latest, recording.sensors)
    units, about = _units(simulation, found, whole, simulation.over(whole)(values, substeps=substeps))
    return Gap(
        value=deviation.value,
        per_experiment=deviation.per_experiment,
        per_output=deviation.per_output,
        floor=least.value,
        floors=least.per_experiment,
        persistence=without_model,
        scale=dict(zip(logs.outputs, recording.scale.tolist(), strict=True)),
        units=units,
        substeps=substeps,
        run=_in_rows(system, recording, steps_of(horizon, logs), found, error),
        notes=(
            *_about_horizon(logs, horizon, runs),
            *_about_errors(recording, error),
            *_about_persistence(deviation.value, without_model),
            *filter(None, [unconverged]),
            *about,
        ),
    )


def replayed(
    backend: MakeBackend, system: System, logs: Logs, horizon: float, runs: Sequence[int]
) -> tuple[float, dict[str, Off]]:
    """Compare free runs on another backend, which has its own step, with the measured outputs."""
    latest = _latest(system, logs, runs)
    recording = Recording.of(logs, horizon, runs, latest)
    whole = Recording.whole(logs, runs, latest, recording.sensors)
    simulation = Simulation(system, recording, backend=backend)
    values = simulation.values[None, None]
    found = simulation(values)
    units, _ = _units(simulation, found, whole, simulation.over(whole)(values))
    return Deviation.of(recording, errors(found, recording.scale) ** 2).value, units


def _latest(system: System, logs: Logs, runs: Sequence[int]) -> float:
    """The longest delay of an output, s."""
    for output in system.outputs:
        for i in runs:
            samples = int(np.diff(logs.offsets)[i])
            if math.floor(output.delay / logs.period + WHOLE) > samples - 2:
                raise BadInput(
                    f"system {system.name}: outputs.{output.name}.delay: {output.delay:g} s is too long for "
                    f"experiment {logs.ids[i]} of {logs.period * (samples - 1):g} s"
                )
    return max((output.delay for output in system.outputs), default=0.0)


def _units(
    simulation: Simulation, found: Runs, longest: Recording, whole: Runs
) -> tuple[dict[str, Off], list[str]]:
    """Return errors in units of the outputs, at the ends of windows and over whole runs, and notes."""
    recording = simulation.recording
    scale, owner = recording.scale, longest.owner
    near, far = found.errors(scale), whole.errors(scale)
    longer = np.asarray(recording.steps == recording.steps.max())
    full = longer | np.isin(recording.start, recording.logs.offsets)
    ends = near[full, recording.steps[full] - 1]
    beyond = ~(np.abs(far) <= DIVERGED)
    diverged = np.asarray((beyond & longest.counted[:, :, None]).any(axis=1))
    units: dict[str, Off] = {}
    shown: dict[str, list[str]] = {}  # outputs by the experiments in which they diverge
    for j, output in enumerate(simulation.system.outputs):
        at_horizon = ends[:, j] if (np.abs(ends[:, j]) <= DIVERGED).all() else None
        over_all = None if diverged[:, j].any() else far[:, :, j][longest.counted]
        errors = [_rms_of(each, scale[j]) for each in (at_horizon, over_all)]
        units[output.name] = Off(output.unit, errors[0], errors[1], output.as_difference)
        if over_all is None:
            where = ", ".join(recording.logs.ids[i] for i in sorted(owner[diverged[:, j]]))
            shown.setdefault(where, []).append(output.name)
    notes = (f"{', '.join(o)}: the simulation of whole runs diverges in {ids}" for ids, o in shown.items())
    return units, list(notes)


def _rms_of(error: Array | None, scale: float) -> float | None:
    return None if error is None else scale * float(np.sqrt(np.mean(error**2)))


def _about_horizon(logs: Logs, horizon: float, runs: Sequence[int]) -> list[str]:
    seconds = steps_of(horizon, logs) * logs.period
    short = [logs.ids[i] for i in runs if np.diff(logs.offsets)[i] - 1 < steps_of(horizon, logs)]
    if horizon > max(float(np.diff(logs.offsets)[i]) for i in runs) * logs.period:
        return [f"the horizon of {horizon:g} s is longer than every experiment: each is simulated as a whole"]
    if short:
        what = (
            f"{short[0]} is" if len(short) == 1 else f"{len(short)} experiments, {short[0]} among them, are"
        )
        return [f"{what} shorter than the horizon of {horizon:g} s: simulated as a whole"]
    if abs(seconds - horizon) > 0.01 * horizon:
        samples = f"a whole number of samples, {seconds / logs.period:.0f} of {logs.period:g} s"
        return [f"the horizon of {horizon:g} s was rounded to {samples}"]
    return []


def _about_errors(recording: Recording, error: Array) -> list[str]:
    beyond = (np.abs(error) >= LARGEST_ERROR)[recording.counted].sum(axis=0)
    return [
        f"{name}: {count} of {recording.steps.sum()} simulated samples diverged or lie more than "
        f"{LARGEST_ERROR:g} standard deviations off, and count as {LARGEST_ERROR:g}"
        for name, count in zip(recording.logs.outputs, beyond.tolist(), strict=True)
        if count
    ]


def _about_persistence(value: float, without_model: float) -> list[str]:
    if value <= without_model:
        return []
    return [
        f"free runs are further off ({value:.3g} standard deviations) than persistence "
        f"({without_model:.3g}), the prediction that every output keeps its value or its speed: check units, "
        "signs and parameters"
    ]


def _in_rows(system: System, recording: Recording, steps: int, found: Runs, error: Array) -> FreeRun:
    """Return simulated outputs beside the samples that show them; error in deviations of the outputs."""
    logs, some = recording.logs, recording.counted
    simulated = found.measured[:, 0] + error * recording.scale
    y = np.full(logs.y.shape, np.nan)
    counted = np.zeros(logs.y.shape, np.bool_)
    window = np.zeros(len(logs.y), np.int64)
    first = np.isin(recording.start, logs.offsets)
    for j, output in enumerate(system.outputs):
        rows = recording.rows[some] + math.floor(output.delay / logs.period + WHOLE)
        y[rows, j], counted[rows, j] = simulated[some][:, j], True
        if output.delay == 0.0:
            y[recording.start[first], j] = found.first[first, 0, j]
    for i in recording.runs:
        window[logs.rows(i)] = np.maximum(np.arange(np.diff(logs.offsets)[i]) - 1, 0) // steps
    return FreeRun(y, counted, window)
