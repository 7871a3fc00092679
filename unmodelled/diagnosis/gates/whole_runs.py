"""Free runs of whole experiments: a model that is right over a window may be far off at the end of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import first_few
from unmodelled.diagnosis.data.gap import DIVERGED, LARGEST_ERROR, MATTERS
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.remark import quantity
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Error of an output over whole runs by its name, in its unit; None where a run diverges.
Errors = Mapping[str, float | None]

#: Part by which an error over whole runs may exceed that of the given file: chance between few experiments.
TOLERANCE = 0.1
#: Experiments that a note names.
NAMED = 4


@dataclass(frozen=True)
class WholeRuns:
    """Free runs from the start to the end of experiments; hidden states start as `simulate` starts them."""

    system: System
    recording: Recording  # experiments, one window each
    #: Errors (experiments, most steps, outputs) in standard deviations of the outputs; not finite: diverged.
    off: Array

    @classmethod
    def of(cls, system: System, logs: Logs, substeps: int, runs: Sequence[int] | None = None) -> WholeRuns:
        """Simulate whole experiments."""
        latest = max((output.delay for output in system.outputs), default=0.0)
        recording = Recording.whole(logs, runs, latest)
        simulation = Simulation(system, recording)
        found = simulation(simulation.values[None, None], substeps=substeps)
        return cls(system, recording, found.errors(recording.scale))

    def errors(self, runs: Sequence[int], since: float = 0.0) -> dict[str, float | None]:
        """Return the root mean square errors over the samples of some experiments."""
        mine = np.isin(self.recording.owner, runs)
        unseen = np.arange(self.off.shape[1]) >= since * self.recording.steps[:, None]
        off = self.off[mine][(self.recording.counted & unseen)[mine]]
        found: dict[str, float | None] = {}
        for output, column, scale in zip(self.system.outputs, off.T, self.recording.scale, strict=True):
            near = (np.abs(column) <= DIVERGED).all()
            found[output.name] = float(scale * np.sqrt(np.mean(column**2))) if near else None
        return found

    def divergence(self, file: str) -> Iterator[str]:
        """Yield a note on experiments in which an output is lost, with the time from which on."""
        recording, logs = self.recording, self.recording.logs
        lost = (~(np.abs(self.off) <= LARGEST_ERROR)).any(axis=2) & recording.counted
        until = dict(zip(recording.owner.tolist(), logs.period * (1.0 + lost.argmax(axis=1)), strict=True))
        gone = sorted(recording.owner[lost.any(axis=1)].tolist(), key=lambda i: until[i])
        if not gone:
            return
        named = first_few([f"{logs.ids[i]} after {until[i]:.3g} s" for i in gone], NAMED)
        yield (
            f"{file} diverges: in a free run over the whole experiment an output is more than "
            f"{LARGEST_ERROR:g} standard deviations off in {len(gone)} of {len(recording.owner)} experiments "
            f"({named}): simulate it for less than {until[gone[0]]:.3g} s from a measured state"
        )


def worse(before: Errors, after: Errors, recording: Recording, units: Mapping[str, str]) -> str:
    """Return which output a file predicts worse over whole runs than the file it came from.

    An error beyond `LARGEST_ERROR` standard deviations counts as this, as in the gap: where the given file
    fails too, as on an unstable machine, nothing is compared. A difference within the noise of the sensor, or
    that does not matter beside the motion, is none.
    """
    logs, largest = recording.logs, LARGEST_ERROR * recording.scale
    times: dict[str, float] = {}
    allowed = np.maximum(recording.noise, MATTERS * recording.scale)
    for name, most, least in zip(logs.outputs, largest.tolist(), allowed.tolist(), strict=True):
        was, now = (most if (e := errors[name]) is None else min(e, most) for errors in (before, after))
        if now > (1.0 + TOLERANCE) * was and now**2 - was**2 > least**2:
            times[name] = now / was if was > 0.0 else np.inf
    if not times:
        return ""
    name = max(times, key=lambda name: times[name])
    old, new = (_said(errors[name], units[name]) for errors in (before, after))
    ids = [logs.ids[i] for i in sorted(recording.runs)]
    return f"over whole experiments ({first_few(ids, NAMED)}) {name} {new}, and {old} with the file as given"


def _said(error: float | None, unit: str) -> str:
    return "diverges" if error is None else f"is {quantity(error, unit, 2)} off"
