"""Checks of the inputs of a diagnosis, beyond those of reading them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from unmodelled.base.errors import BadInput, closest
from unmodelled.diagnosis.data.gap import steps_of
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.effects.library import effects
from unmodelled.effects.own_law import Law
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Experiments at least: one to fit, and one that is left out.
FEWEST_EXPERIMENTS = 2
#: Samples that a window predicts at least.
FEWEST_PREDICTED = 5
#: Windows on which divergence is checked, and integration steps per sample of the second attempt.
CHECKED_WINDOWS, FINE_SUBSTEPS = 400, 8


def check_seed(seed: int) -> None:
    """Refuse a seed that is not a whole number from 0 on."""
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise BadInput(f"seed: must be a whole number, 0 or more, got {seed!r}")


def check_families(without: Sequence[str]) -> None:
    """Refuse families to leave out that the library does not have."""
    known = sorted({effect.family for effect in effects()})
    for family in without:
        if family not in known:
            raise BadInput(f"without: there is no family {str(family)!r}{closest(str(family), known)}")


def check_laws(laws: Sequence[Law], system: System, logs: Logs, horizon: float) -> None:
    """Refuse laws of the user that keep no rule of `check_effect` where they can act, or act nowhere."""
    if laws:
        scales = Study.of(system, logs, horizon, 0).scales
        for law in laws:
            law.check(system, scales)


def check(system: System, logs: Logs, horizon: float) -> None:
    """Refuse inputs that a diagnosis cannot answer."""
    if len(logs) < FEWEST_EXPERIMENTS:
        source = Path(logs.source)
        table = str(source / "experiments.csv" if source.is_dir() else source) if logs.source else "logs"
        raise BadInput(
            f"{table}: column id: {len(logs)} experiment, too short to be cut into several; a diagnosis "
            f"needs {FEWEST_EXPERIMENTS} or more, as each is left out once; add another log"
        )
    _recording(system, logs, horizon)


def check_windows(system: System, logs: Logs, horizon: float) -> None:
    """Refuse windows that cannot be simulated; ask for faults of the logs first, they are a better answer."""
    if (steps := steps_of(horizon, logs)) < FEWEST_PREDICTED:
        raise BadInput(
            f"horizon: {horizon:g} s are {steps} samples of {logs.period:g} s; "
            f"{FEWEST_PREDICTED} or more are needed; give a longer horizon"
        )
    _check_simulation(system, logs, horizon)


def _check_simulation(system: System, logs: Logs, horizon: float) -> None:
    simulation = Simulation(system, _recording(system, logs, horizon).thinned(CHECKED_WINDOWS))
    values = simulation.values[None, None]
    diverged = simulation(values).diverged
    if diverged.all():
        diverged = simulation(values, substeps=FINE_SUBSTEPS).diverged
    if np.all(diverged):
        raise BadInput(
            f"{system.place}: dynamics: the simulation diverges within {horizon:g} s from every measured "
            f"state; check signs, parameters and units"
        )


def _recording(system: System, logs: Logs, horizon: float) -> Recording:
    latest = max(output.delay for output in system.outputs)
    try:
        return Recording.of(logs, horizon, latest=latest)
    except ValueError as error:
        raise BadInput(f"{system.place}: outputs: {error}") from None
