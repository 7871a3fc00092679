"""Read TDMS files of LabVIEW with npTDMS."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.logs.readers.reader import Reader, Table

#: Properties of a waveform: time of its first sample, s since its start, and time between samples, s.
OFFSET, INCREMENT, START = "wf_start_offset", "wf_increment", "wf_start_time"
UNIT = "unit_string"
#: Length, first instant and increment of a waveform, s; a channel without increment has the length alone.
Clock = tuple[int, float, float]


class Tdms(Reader):
    """Reader of TDMS files: the channels of a group with one clock are a table.

    The clock is that of waveforms, from the start of the first one in the file; columns of dates are columns
    like any other.
    """

    name = "TDMS"
    install = "npTDMS"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith(b"TDSm")

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from nptdms import TdmsFile

        # by a path, it would trust an index beside the file
        with path.open("rb") as raw, TdmsFile.open(raw) as file:
            groups = [(group.name, channel) for group in file.groups() for channel in group.channels()]
            first = min((s for _, channel in groups if (s := _start(channel)) is not None), default=None)
            together: dict[tuple[str, Clock], list[Any]] = {}
            for name, channel in groups:
                together.setdefault((name, _clock(channel, first)), []).append(channel)
            found = [_table(name, clock, channels) for (name, clock), channels in together.items()]
        return [table for table in found if len(table)]


def _start(channel: Any) -> np.datetime64 | None:
    """The instant at which a waveform begins."""
    started = channel.properties.get(START)
    return np.datetime64(started, "ns") if INCREMENT in channel.properties and started is not None else None


def _clock(channel: Any, first: np.datetime64 | None) -> Clock:
    increment = float(channel.properties.get(INCREMENT, 0.0))
    if increment <= 0.0:
        return len(channel), 0.0, 0.0
    started = _start(channel)
    since = 0.0 if started is None or first is None else (started - first) / np.timedelta64(1, "s")
    return len(channel), since + float(channel.properties.get(OFFSET, 0.0)), increment


def _instants(clock: Clock) -> Array | None:
    count, first, increment = clock
    return np.asarray(first + increment * np.arange(count), np.float64) if increment else None


def _table(name: str, clock: Clock, channels: Sequence[Any]) -> Table:
    """The table of channels of one group and clock."""
    columns, texts = dict[str, Array](), dict[str, Sequence[str]]()
    units, origins = dict[str, str](), dict[str, int]()
    for channel in channels:
        values, own = np.asarray(channel[:]), channel.name
        if unit := str(channel.properties.get(UNIT, "")):
            units[own] = unit
        if values.dtype.kind in "fiub":
            columns[own] = values.astype(np.float64)
        elif values.dtype.kind == "M" and len(values):
            ticks = values.astype("datetime64[ns]").astype(np.int64)
            columns[own], units[own], origins[own] = 1e-9 * (ticks - ticks[0]), "s", int(ticks[0])
        elif values.dtype.kind in "OU":
            texts[own] = [str(value) for value in values]
    known = {own: unit for own, unit in units.items() if own in columns or own in texts}
    return Table(name, columns, known, texts, clock=_instants(clock), origins=origins)
