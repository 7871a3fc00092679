"""Measured experiments as a caller reads and writes them: data frames, stores and HDF5 files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput, Faults
from unmodelled.base.shapes import check_shape
from unmodelled.logs.assembly import assembled, checked_in_si, units_of
from unmodelled.logs.cells import frame_columns
from unmodelled.logs.constants import logged, with_constants
from unmodelled.logs.frames import FramesGiven, frames_of
from unmodelled.logs.hdf5 import write_hdf5
from unmodelled.logs.measurements import Continued, Measurements, names
from unmodelled.logs.recognition import refuse_missing
from unmodelled.logs.table import Columns, TextTable, check_repeated, check_texts
from unmodelled.systems.model import Input, Logged, Output, System

OWN = ("exp", "samples")  # columns of the store's table that a user's column must not take
GROUPS = ("outputs", "inputs", "states", "constants")
ORIGIN = {"data": "measured", "description": "data frames"}
HEADER = "logs"  # what the store's provenance holds beyond that of the data
SHAPE = {name: [str] for name in (*GROUPS, "notes")} | {"period": float, "delays": [float]}
SHAPE |= {"limits?": {"*": [(float, None)]}, "clock?": str}


class Logs(Measurements):
    """Measured experiments of one campaign, frozen, with the forms in which they are read and written.

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
        x: estimated states, shape (samples, states).
        measured: True per state that an output shows, itself or its position.
        notes: sentences on what was done to the data.
        provenance: origin of the data; `data` is "measured" or "virtual".
        delays: delays that `u` includes already, one per input, s; none where it is empty.
        continues: experiment that every experiment continues, None where a record begins; empty where none
            continues another. States that no output shows go on from there.
        source: folder that the logs were read from, "" where there is none.
        limits: smallest and largest value of outputs whose sensor ends there, by name, infinite where there
            is no end; samples at them are not compared.
        clock: unit of the clock as logged ("ms"), in which sentences tell places in a log, and in which
            experiments and simulations are written; all numbers of this object are in s.
    """

    @classmethod
    def from_frames(
        cls, frames: FramesGiven, system: System, experiments: pd.DataFrame | None = None
    ) -> Logs:
        """Take over measured experiments from data frames, with the checks of `read_logs`.

        Args:
            frames: experiments by their ids, in a list, or one data frame (with the column `experiment`, if
                it has several); a mapping of columns stands for a data frame. Each has the column `t` (s,
                dates or durations) and those that the inputs and outputs of `system` name, in their units; a
                row per sample, 50 or more.
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
        named = frames_of(frames)
        table, faults, logs = _table(list(named), experiments), Faults(), []
        if named:
            refuse_missing("experiments: row 1", "the table", table.header, logged(system))
        for name, frame in named.items():
            with faults.collected():
                log = _columns(Path(f"frames[{name!r}]"), frame, list(units_of(system)))
                logs.append(checked_in_si(log, system))
        return assembled(cls, system, table, logs, ORIGIN, faults)

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
            "limits": {name: [_written(end) for end in ends] for name, ends in self.limits.items()},
            "clock": self.clock,
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
        items: list[Output | Input] = [*system.outputs, *system.inputs]
        signals = zip(items, (*self.y.T, *self.u.T), strict=True)
        columns = {"t": self.t, **{item.column: as_logged(item, values) for item, values in signals}}
        samples = [{name: values[self.rows(i)] for name, values in columns.items()} for i in range(len(self))]
        given = {c.name: as_logged(c, self.experiments[c.name].to_numpy()) for c in system.operating_point}
        write_hdf5(path, self.experiments.assign(**given), samples, units_of(system), self.provenance)

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
        continues = tuple(Continued(*each) if each else None for each in header.get("continues", ()))
        return cls.without_states(
            system,
            table,
            period=header["period"],
            offsets=store.offsets,
            t=np.asarray(store.signals["t"], np.float64),
            y=y,
            u=u,
            notes=tuple(dict.fromkeys([*header["notes"], *notes])),
            provenance=provenance,
            # a store that does not say after which delays its inputs act was written for this system
            delays=tuple(header["delays"]) or tuple(item.delay for item in system.inputs),
            continues=continues if any(continues) else (),
            limits={name: _ends(ends) for name, ends in header.get("limits", {}).items()},
            clock=header.get("clock", "s"),
        )


def _written(end: float) -> float | None:
    """Return an end of a range as JSON has it: null where there is none."""
    return end if np.isfinite(end) else None


def _ends(written: Sequence[float | None]) -> tuple[float, float]:
    low, high = written
    return -np.inf if low is None else low, np.inf if high is None else high


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


def as_logged(item: Logged, values: Array) -> Array:
    """Return values (any shape) of a signal in the unit of its column."""
    return values if item.logged is None else item.logged.from_si(values)


def _table(ids: list[str], experiments: pd.DataFrame | None) -> TextTable:
    """The table of data frames as experiments.csv would be; the files are the ids."""
    if experiments is not None and (unknown := set(ids) ^ set(experiments.index)):
        raise BadInput(
            f"experiments: its index and the frames must have the same ids; {min(unknown)!r} is in one only"
        )
    more = [] if experiments is None else [name for name in experiments.columns if name not in ("id", "file")]
    rows = []
    for row, name in enumerate(ids, start=2):
        cells = [] if experiments is None else experiments.loc[name, more].tolist()
        rows.append((row, [str(cell).strip() for cell in (name, name, *cells)]))
    return TextTable(Path("experiments"), ["id", "file", *map(str, more)], rows)


def _columns(path: Path, frame: pd.DataFrame, wanted: list[str]) -> Columns:
    """Return the wanted columns of a frame; `path` is its name in messages."""
    frame = _with_time(frame)
    names = [str(name) for name in frame.columns]
    check_repeated(path, names)
    refuse_missing(f"{path}: row 1", "the frame", names, wanted)
    found = frame_columns(path, {name: frame.iloc[:, names.index(name)] for name in wanted})
    return Columns(path, found, header=False)


def _with_time(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the frame with a column t: its index stands for a missing one, unless it only counts rows."""
    counts = pd.api.types.is_integer_dtype(frame.index.dtype)
    return frame if "t" in frame.columns or counts else frame.assign(t=frame.index)
