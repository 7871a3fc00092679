"""Measured experiments of one system in memory, on one uniform clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.systems.model import System

Names = tuple[str, ...]

#: Share of all samples in experiments whose length does not count as usual: one short part of a record must
#: not set the horizon of all others.
SHORT_ONES = 0.1
#: Their largest length, relative to the shortest other experiment: runs that differ by less are usual.
SHORT = 0.5


class Continued(NamedTuple):
    """Experiment of the same record that ended before another one began."""

    id: str
    periods: int  # from its last sample to the first sample of the other one


#: Kind of measurements, which functions return as they got it.
M = TypeVar("M", bound="Measurements")


@dataclass(frozen=True, repr=False)
class Measurements:
    """Measured experiments of one campaign, frozen.

    The samples of all experiments stand one after the other: experiment `i` owns the rows
    `offsets[i]:offsets[i + 1]`. Units are those of the system file.
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    constants: tuple[str, ...]
    ids: tuple[str, ...]
    experiments: pd.DataFrame  # a row each: id, file, group if there is one, operating point, further columns
    period: float  # s
    offsets: Indices  # (experiments + 1,), first samples
    t: Array  # (samples,), since the start of the experiment, s
    y: Array  # (samples, outputs), angles unwrapped
    u: Array  # (samples, inputs), after the delays
    c: Array  # (experiments, constants)
    x: Array  # (samples, states), estimated; none before `preparation.prepare`
    measured: tuple[bool, ...]  # per state: an output shows it or its position
    notes: tuple[str, ...]
    provenance: Mapping[str, Any]
    delays: tuple[float, ...] = ()  # that u includes, one per input, s; (): none
    #: Experiment that every one continues, None where a record begins; (): none does.
    continues: tuple[Continued | None, ...] = ()
    source: str = field(default="", compare=False)
    #: Smallest and largest value of outputs by name, infinite where there is none: samples there measure
    #: nothing and are not compared.
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    clock: str = "s"  # unit of the clock as logged, in which places are told and files are written

    def __len__(self) -> int:
        return len(self.ids)

    def __repr__(self) -> str:
        longest = float(np.diff(self.offsets).max()) * self.period
        samples = f"{len(self.t)} samples every {self.period:g} s"
        lines = [
            f"{len(self)} experiments, {samples}, up to {longest:.4g} s long",
            f"outputs: {', '.join(self.outputs)}",
            f"inputs: {', '.join(self.inputs) or 'none'}",
        ]
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def table(self) -> pd.DataFrame:
        """Return a row per sample: experiment, t (s), and outputs and inputs in their units.

        Outputs are as logged, unwrapped; inputs are as they act, after their delay.
        """
        columns: dict[str, Any] = {"experiment": np.array(self.ids, object)[self.owner], "t": self.t}
        columns |= {name: self.y[:, j] for j, name in enumerate(self.outputs)}
        columns |= {name: self.u[:, j] for j, name in enumerate(self.inputs) if name not in columns}
        return pd.DataFrame(columns)

    @cached_property
    def owner(self) -> Indices:
        """Number of the experiment of every sample, shape (samples,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.offsets))

    @cached_property
    def left_out(self) -> Mask | None:
        """Samples at the end of an output's range, shape (samples, outputs); None if there are none."""
        if not set(self.limits) & set(self.outputs):
            return None
        low, high = np.array([self.limits.get(name, (-np.inf, np.inf)) for name in self.outputs]).T
        return np.asarray((self.y <= low) | (self.y >= high))

    def rows(self, i: int) -> slice:
        """Return the rows of experiment number `i`."""
        return slice(int(self.offsets[i]), int(self.offsets[i + 1]))

    @property
    def usual_length(self) -> int:
        """Samples of the shortest experiment that is no part beside much longer ones.

        Such parts hold a tenth of all samples together, and each is less than half as long as all others.
        """
        lengths = np.sort(np.diff(self.offsets))
        least = lengths[np.searchsorted(np.cumsum(lengths), SHORT_ONES * self.offsets[-1], "right")]
        return int(lengths[lengths >= SHORT * least][0])

    def gap(self, i: int) -> int | None:
        """Return the sampling periods between experiment `i` and the one that it continues, None if none."""
        before = self.continues[i] if self.continues else None
        return before.periods if before and i and self.ids[i - 1] == before.id else None

    def experiments_with_speed(self) -> pd.DataFrame:
        """Return the experiments table with a column rms_<state> for every state, its size in each."""
        columns = {
            f"rms_{name}": [float(np.sqrt(np.mean(self.x[self.rows(i), j] ** 2))) for i in range(len(self))]
            for j, name in enumerate(self.states)
        }
        return self.experiments.assign(**columns)

    def among(self, runs: Sequence[int]) -> Self:
        """Return the experiments with some numbers, in the order of these."""
        rows = np.concatenate([np.arange(self.offsets[i], self.offsets[i + 1]) for i in runs])
        lengths = [int(self.offsets[i + 1] - self.offsets[i]) for i in runs]
        return replace(
            self,
            ids=tuple(self.ids[i] for i in runs),
            experiments=self.experiments.iloc[list(runs)].reset_index(drop=True),
            offsets=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
            **{name: getattr(self, name)[rows] for name in ("t", "y", "u", "x")},
            c=self.c[list(runs)],
            continues=tuple(self.continues[i] for i in runs) if self.continues else (),
        )

    @classmethod
    def without_states(cls, system: System, experiments: pd.DataFrame, t: Array, **others: Any) -> Self:
        """Return measurements in the units of the system file, without states: see `preparation.prepare`.

        Has times t (samples,), and a row of `experiments` each with `id` and operating point.
        """
        outputs, inputs, _, constants = names(system)
        c = experiments[list(constants)].to_numpy(np.float64)
        own = {"ids": tuple(experiments["id"]), "c": c, "x": np.empty((len(t), 0)), "measured": ()}
        return cls(outputs, inputs, (), constants, experiments=experiments, t=t, **own, **others)


def names(system: System) -> tuple[Names, Names, Names, Names]:
    """Return the names of the outputs, inputs, states and constants of a system."""
    return (
        tuple(item.name for item in system.outputs),
        tuple(item.name for item in system.inputs),
        tuple(item.name for item in system.states),
        tuple(item.name for item in system.operating_point),
    )
