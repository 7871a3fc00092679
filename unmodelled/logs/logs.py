"""Measured experiments of one system, on one uniform clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.shapes import check_shape
from unmodelled.logs.constants import logged, with_constants
from unmodelled.logs.hdf5 import write_hdf5
from unmodelled.logs.table import check_texts
from unmodelled.systems.model import Logged, System

Array = NDArray[np.float64]
Names = tuple[str, ...]

OWN = ("exp", "samples")  # columns of the store's table that a user's column must not take
GROUPS = ("outputs", "inputs", "states", "constants")
HEADER = "logs"  # what the store's provenance holds beyond that of the data
#: Share of all samples in experiments whose length does not count as usual: one short part of a record must
#: not set the horizon of all others.
SHORT_ONES = 0.1
#: Their largest length, relative to the shortest other experiment: runs that differ by less are usual.
SHORT = 0.5
SHAPE = {name: [str] for name in (*GROUPS, "notes")} | {"period": float, "delays": [float]}


class Continued(NamedTuple):
    """Experiment of the same record that ended before another one began.

    Attributes:
        id: its id.
        periods: sampling periods from its last sample to the first sample of the other one.
    """

    id: str
    periods: int


@dataclass(frozen=True, repr=False)
class Logs:
    """Measured experiments of one campaign, frozen.

    The samples of all experiments stand one after the other: experiment `i` owns the rows
    `offsets[i]:offsets[i + 1]`. Units are those of the system file.

    Attributes:
        outputs: names of the outputs, in the order of the columns of `y`.
        inputs: names of the inputs, in the order of the columns of `u`.
        states: names of the states, in the order of the columns of `x`.
        constants: names of the constants of the operating point, in the order of the columns of `c`.
        ids: names of the experiments.
        experiments: table with `id`, `file`, `group` if there is one, the operating point and further
            columns, a row per experiment.
        period: sampling period, s.
        offsets: first samples of the experiments, and the number of all samples, shape (experiments + 1,).
        t: time since the start of the experiment, shape (samples,), s.
        y: measured outputs, angles unwrapped, shape (samples, outputs).
        u: inputs after `delays`, shape (samples, inputs).
        c: constants of the operating points, shape (experiments, constants).
        x: estimated states, shape (samples, states); there are none before `preparation.prepare`.
        measured: True per state that an output shows, itself or its position.
        notes: sentences on what was done to the data.
        provenance: origin of the data; `data` is "measured" or "virtual".
        delays: delays that `u` includes already, one per input, s; none where it is empty.
        continues: experiment that every experiment continues, None where a record begins; empty where none
            continues another. States that no output shows go on from there.
        source: folder that the logs were read from, "" where there is none.
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    constants: tuple[str, ...]
    ids: tuple[str, ...]
    experiments: pd.DataFrame
    period: float
    offsets: NDArray[np.int64]
    t: Array
    y: Array
    u: Array
    c: Array
    x: Array
    measured: tuple[bool, ...]
    notes: tuple[str, ...]
    provenance: Mapping[str, Any]
    delays: tuple[float, ...] = ()
    continues: tuple[Continued | None, ...] = ()
    source: str = field(default="", compare=False)

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
        columns: dict[str, Any] = {"experiment": np.array(self.ids)[self.owner], "t": self.t}
        columns |= {name: self.y[:, j] for j, name in enumerate(self.outputs)}
        columns |= {name: self.u[:, j] for j, name in enumerate(self.inputs) if name not in columns}
        return pd.DataFrame(columns)

    @classmethod
    def from_frames(
        cls, frames: Mapping[str, pd.DataFrame], system: System, experiments: pd.DataFrame | None = None
    ) -> Logs:
        """Take over measured experiments from data frames, with the checks of `read_logs`.

        Args:
            frames: experiments by their ids, each with the column `t` (s, dates or durations) and the columns
                that the inputs and outputs of `system` name, in their units; a row per sample, 50 or more.
            system: system whose inputs and outputs name the columns.
            experiments: optional table whose index holds the ids; its columns are the constants of the
                operating point of each experiment, optionally `group`, anything else.

        Raises:
            BadInput: a line for every fault, which names frame, row (counted from 1) and column.

        Examples:
            >>> import unmodelled as um
            >>> system, logs = um.example("pendulum")
            >>> frames = dict(iter(logs.table().groupby("experiment")))
            >>> um.Logs.from_frames(frames, system)
            4 experiments, 1600 samples every 0.005 s, up to 2 s long
            outputs: theta
            inputs: torque
            note: omega was estimated from theta by smoothing differentiation over 21 samples
        """
        from unmodelled.logs.frames import read_frames

        return read_frames(frames, system, experiments)

    @cached_property
    def owner(self) -> NDArray[np.int64]:
        """Number of the experiment of every sample, shape (samples,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.offsets))

    def rows(self, i: int) -> slice:
        """Return the rows of one experiment.

        Args:
            i: number of the experiment.
        """
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
        """Return the sampling periods since the experiment before, None if it is not continued.

        Args:
            i: number of the experiment.
        """
        before = self.continues[i] if self.continues else None
        return before.periods if before and i and self.ids[i - 1] == before.id else None

    def experiments_with_speed(self) -> pd.DataFrame:
        """Return the experiments table with a column rms_<state> for every state, its size in each."""
        columns = {
            f"rms_{name}": [float(np.sqrt(np.mean(self.x[self.rows(i), j] ** 2))) for i in range(len(self))]
            for j, name in enumerate(self.states)
        }
        return self.experiments.assign(**columns)

    def among(self, runs: Sequence[int]) -> Logs:
        """Return some of the experiments.

        Args:
            runs: numbers of the experiments, in the order that is wanted.
        """
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

    def write(self, folder: Path) -> None:
        """Write a store that `read_logs` reads back exactly.

        It can be read for a system with other states, delays and values of constants as well, see
        `Campaign.write`.

        Args:
            folder: folder to be written; replaced as a whole.
        """
        signals = {"t": self.t}
        for kind, group in zip("yux", (self.outputs, self.inputs, self.states), strict=True):
            signals |= {f"{kind}.{name}": getattr(self, kind)[:, j] for j, name in enumerate(group)}
        table = self.experiments.rename(columns={name: f"columns.{name}" for name in OWN})
        table.insert(0, "exp", np.arange(len(self), dtype=np.int32))
        header = {
            **{name: list(getattr(self, name)) for name in GROUPS},
            **{"period": self.period, "measured": list(self.measured), "notes": list(self.notes)},
            "delays": list(self.delays),
            "continues": [list(before) if before else [] for before in self.continues],
        }
        Campaign(table, signals, self.offsets, {**self.provenance, HEADER: header}).write(folder)

    def to_hdf5(self, path: Path, system: System) -> None:
        """Write the measurements as one HDF5 file with a group per experiment, which `read_logs` reads back.

        Args:
            path: file to write or replace.
            system: system of the logs, for the names and units of their columns.

        Raises:
            BadInput: when the system has other inputs or outputs or delays its inputs, when an id cannot be
                the name of a group, or when the file cannot be written.
        """
        outputs, inputs, _, _ = names(system)
        if (self.outputs, self.inputs) != (outputs, inputs) or any(self.delays):
            raise BadInput(
                f"system {system.name}: must have the inputs and outputs of the logs, and no delays"
            )
        columns = {"t": self.t}
        columns |= {o.column: as_logged(o, self.y[:, j]) for j, o in enumerate(system.outputs)}
        columns |= {i.column: as_logged(i, self.u[:, j]) for j, i in enumerate(system.inputs)}
        units = {o.column: o.column_unit for o in system.outputs}
        units |= {i.column: i.column_unit for i in system.inputs}
        samples = [{name: values[self.rows(i)] for name, values in columns.items()} for i in range(len(self))]
        given = {c.name: as_logged(c, self.experiments[c.name].to_numpy()) for c in system.operating_point}
        write_hdf5(path, self.experiments.assign(**given), samples, {"t": "s", **units}, self.provenance)

    @classmethod
    def read(cls, folder: Path, system: System) -> Logs:
        """Read what `write` wrote, without states: see `preparation.prepare`.

        Args:
            folder: folder that `write` wrote.
            system: system with the same inputs, outputs and constants.

        Raises:
            BadInput: when it is damaged, was written for a system with other inputs, outputs or constants, or
                lacks a constant.
        """
        store, header, provenance = _stored(folder, system)
        outputs, inputs, *_ = names(system)
        table = store.experiments.drop(columns=list(OWN))
        table = table.rename(columns={f"columns.{name}": name for name in OWN})
        check_texts(folder / "experiments.parquet", table, range(1, len(table) + 1))
        rows = [f"{folder}: experiments.parquet: row {i + 1}: column id" for i in range(len(table))]
        table, notes = with_constants(system, table, rows)
        y, u = (
            np.array([store.signals[f"{kind}.{name}"] for name in group])
            .reshape(-1, int(store.offsets[-1]))
            .T.copy()
            for kind, group in zip("yu", (outputs, inputs), strict=True)
        )
        return cls.measurements(
            system,
            experiments=table,
            period=header["period"],
            offsets=store.offsets,
            t=np.asarray(store.signals["t"], np.float64),
            y=y,
            u=u,
            notes=tuple(dict.fromkeys([*header["notes"], *notes])),
            provenance=provenance,
            # a store that does not say after which delays its inputs act was written for this system
            delays=tuple(header["delays"]) or tuple(item.delay for item in system.inputs),
            continues=tuple(Continued(*each) if each else None for each in header.get("continues", ())),
        )

    @classmethod
    def measurements(
        cls,
        system: System,
        *,
        experiments: pd.DataFrame,
        period: float,
        offsets: NDArray[np.int64],
        t: Array,
        y: Array,
        u: Array,
        notes: tuple[str, ...],
        provenance: Mapping[str, Any],
        delays: tuple[float, ...] = (),
        continues: tuple[Continued | None, ...] = (),
    ) -> Logs:
        """Return measurements without states: see `preparation.prepare`.

        Args:
            system: system whose names the columns have.
            experiments: table with `id` and the operating point, a row per experiment.
            period: sampling period, s.
            offsets: first samples of the experiments, and the number of all, shape (experiments + 1,).
            t: time since the start of the experiment, shape (samples,), s.
            y: measured outputs, shape (samples, outputs), in the units of the system file.
            u: inputs after `delays`, shape (samples, inputs), in the units of the system file.
            notes: sentences on what was done to the data.
            provenance: origin of the data.
            delays: delays that `u` includes already, one per input, s; none unless given.
            continues: experiment that every experiment continues, default: none does.
        """
        outputs, inputs, _, constants = names(system)
        return cls(
            *(outputs, inputs, (), constants),
            ids=tuple(experiments["id"]),
            experiments=experiments,
            period=period,
            offsets=offsets,
            t=t,
            y=y,
            u=u,
            c=experiments[list(constants)].to_numpy(np.float64),
            x=np.empty((len(t), 0)),
            measured=(),
            notes=notes,
            provenance=provenance,
            delays=delays or (0.0,) * len(inputs),
            continues=continues if any(continues) else (),
        )


def _stored(folder: Path, system: System) -> tuple[Campaign, dict[str, Any], dict[str, Any]]:
    """A store of logs of `system`, what its provenance says of the logs, and the provenance of the data."""
    store = Campaign.read(folder)
    provenance = dict(store.provenance)
    header = provenance.pop(HEADER, None)
    check_shape(folder / "provenance.json", {HEADER: header}, {HEADER: SHAPE})
    if header["period"] <= 0.0 or not _written_for(system, header):
        raise BadInput(f"{folder}: provenance.json: was not written for the system {system.name}")
    outputs, inputs, _, _ = names(system)
    wanted = ["t", *(f"y.{name}" for name in outputs), *(f"u.{name}" for name in inputs)]
    if lacking := [name for name in wanted if name not in store.signals]:
        raise BadInput(f"{folder}: damaged store (signals.parquet has no column {lacking[0]})")
    if "id" not in store.experiments or len(store.experiments) == 0:
        raise BadInput(f"{folder}: damaged store (experiments.parquet has no column id, or no rows)")
    return store, header, provenance


def _written_for(system: System, header: Mapping[str, Any]) -> bool:
    """Whether a store has the inputs, outputs and constants of `system`, save those that its file gives."""
    outputs, inputs, _, constants = names(system)
    own = logged(system)
    stored = [name for name in header["constants"] if name in own or name not in constants]
    delays = len(header["delays"]) in (0, len(inputs))
    return delays and (header["outputs"], header["inputs"], stored) == (list(outputs), list(inputs), own)


def names(system: System) -> tuple[Names, Names, Names, Names]:
    """Return the names of the outputs, inputs, states and constants of a system."""
    return (
        tuple(item.name for item in system.outputs),
        tuple(item.name for item in system.inputs),
        tuple(item.name for item in system.states),
        tuple(item.name for item in system.operating_point),
    )


def as_logged(item: Logged, values: Array) -> Array:
    """Return values of a signal in the unit of its column.

    Takes values (any shape); gives (shape of the given).
    """
    return values if item.logged is None else item.logged.from_si(values)
