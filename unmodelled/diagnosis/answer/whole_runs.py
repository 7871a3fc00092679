"""Free runs of the exported file over whole experiments: a model that is right over a window may diverge."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.remark import quantity
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.systems.reader import read_system

#: Experiments that a note names.
NAMED = 4


def whole_run_notes(diagnosis: Diagnosis, file: Path) -> Iterator[str]:
    """Yield notes on free runs of the exported file that diverge, and on laws that go beyond the data.

    All experiments are simulated from their first state to their end, the held-out ones too.

    Args:
        diagnosis: diagnosis with an augmented model.
        file: system file of the augmented model.

    Yields:
        Notes, a sentence each.

    Raises:
        BadInput: when `file` cannot be read back.
    """
    yield from (note for found in diagnosis.effects for note in _extent(diagnosis, found))
    until = _diverged(diagnosis, file)
    logs = diagnosis.logs
    gone = sorted((i for i in range(len(logs)) if np.isfinite(until[i])), key=lambda i: float(until[i]))
    if not gone:
        return
    held = {i: " (held out)" if i in diagnosis.held_out else "" for i in gone}
    named = ", ".join(f"{logs.ids[i]}{held[i]} after {until[i]:.3g} s" for i in gone[:NAMED])
    more = f" and {len(gone) - NAMED} more" if len(gone) > NAMED else ""
    yield (
        f"{file.name} diverges: in a free run over the whole experiment an output is more than "
        f"{LARGEST_ERROR:g} standard deviations off in {len(gone)} of {len(logs)} experiments "
        f"({named}{more}): simulate it for less than {until[gone[0]]:.3g} s from a measured state"
    )


def _diverged(diagnosis: Diagnosis, file: Path) -> NDArray[np.float64]:
    """Return the times of divergence of whole runs, shape (experiments,), s; inf for runs that stay near."""
    system, model = read_system(file), diagnosis.augmented
    latest = max((output.delay for output in system.outputs), default=0.0)
    recording = Recording.whole(model.logs, latest=latest)
    simulation = Simulation(system, recording)
    runs = simulation(simulation.values[None, None], substeps=model.gap.substeps)
    lost = (~(np.abs(runs.errors(recording.scale)) <= LARGEST_ERROR)).any(axis=2) & recording.counted
    first = np.where(lost.any(axis=1), model.logs.period * (1.0 + lost.argmax(axis=1)), np.inf)
    until = np.full(len(model.logs), np.inf)
    until[recording.owner] = first
    return until


def _extent(diagnosis: Diagnosis, found: DiagnosedEffect) -> Iterator[str]:
    values = {p.name: p for p in diagnosis.augmented.system.parameters}
    for name, edges in found.added.extent.items():
        low, high = (values[edge].value for edge in edges)
        farthest = quantity(high, values[edges[0]].unit)
        yield (
            f"{found.added.law} was fitted for {name} from {low:.3g} to {farthest}; beyond, the exported "
            "file goes on straight, which no measurement supports: log more travel to use it there"
        )
