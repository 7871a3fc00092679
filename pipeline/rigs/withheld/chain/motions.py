"""Kinds of motion: those of the logs, and others for validation."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from pipeline.arrays import Array
from pipeline.rigs.withheld.experiments import KINDS as SMOOTH
from pipeline.rigs.withheld.experiments import TURN, Kind, smooth

LEARNED = 3  # kinds
LINES = 12  # frequencies of a multisine


def _multisine(t: Array, band: float, rng: np.random.Generator) -> Array:
    """Return a sum of equally strong harmonics of the run with random phases."""
    frequencies = np.linspace(band / LINES, band, LINES)
    phases = rng.uniform(0.0, TURN, LINES)
    total = np.sum(np.sin(TURN * np.multiply.outer(t, frequencies) + phases), axis=-1)
    return np.asarray(total / np.max(np.abs(total)))


def _steps(t: Array, band: float, rng: np.random.Generator) -> Array:
    """Return steps between random levels at random times."""
    count, rise = max(4, round(1.5 * t[-1])), 0.15 / band
    begin = (np.arange(count) + rng.uniform(0.0, 0.6, count)) * t[-1] / count
    jumps = np.diff(rng.uniform(-1.0, 1.0, count), prepend=0.0)
    return sum((j * smooth((t - b) / rise) for j, b in zip(jumps, begin, strict=True)), np.zeros_like(t))


#: Kinds of motion by name.
KINDS: Mapping[str, Kind] = {**SMOOTH, "multisine": _multisine, "steps": _steps}


class Motions(NamedTuple):
    """Names of the kind of every run, in `KINDS`: those of the logs, then those of the validation."""

    learned: tuple[str, ...]
    validation: tuple[str, ...]

    @property
    def kinds(self) -> Sequence[Kind]:
        """The kinds of all runs."""
        return [KINDS[name] for name in (*self.learned, *self.validation)]


def drawn_motions(learned: int, validation: int, rng: np.random.Generator) -> Motions:
    """Draw kinds for `learned` runs, and others for `validation` runs."""
    order = [list(KINDS)[k] for k in rng.permutation(len(KINDS)).tolist()]
    mine, others = order[:LEARNED], order[LEARNED:]
    return Motions(
        tuple(mine[i % len(mine)] for i in range(learned)),
        tuple(others[i % len(others)] for i in range(validation)),
    )
