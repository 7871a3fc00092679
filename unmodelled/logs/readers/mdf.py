"""Read MDF files (measurement data format, versions 2 to 4) with asammdf."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from unmodelled.logs.readers.reader import Array, Table
from unmodelled.logs.readers.records import listed


class Mdf:
    """Reader of MDF files: every channel group is a table with the clock of its master channel."""

    name = "MDF"
    install = "asammdf"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        """Return whether a file begins as an MDF file does, finished or not."""
        return start.startswith((b"MDF     ", b"UnFinMF "))

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        """Read the channels of all groups, only those that are used if all of them are found by name."""
        from asammdf import MDF

        with MDF(path) as file:
            names = {channel.name for group in file.groups for channel in group.channels}
            used = None if wanted is None else {n for n in names if any(_is_of(w, n) for w in wanted)}
            if used is not None and not all(any(_is_of(w, n) for n in used) for w in wanted or ()):
                used = None
            found = [_table(file, number, used) for number in range(len(file.groups))]
        return [table for table in found if table.columns or table.texts]


def _is_of(wanted: str, name: str) -> bool:
    """Whether a name in a mapping may be that of a channel, or of an element of it."""
    return f".{wanted}".endswith(f".{name}") or f".{name}[" in f".{wanted}"


def _table(file: Any, number: int, used: set[str] | None) -> Table:
    group = file.groups[number]
    called = str(group.channel_group.acq_name or "").strip()
    name = "" if len(file.groups) == 1 else called or f"group{number}"
    columns: dict[str, Array] = {}
    texts: dict[str, list[str]] = {}
    units: dict[str, str] = {}
    clock: Array | None = None
    for index, channel in enumerate(group.channels):
        if index == file.masters_db.get(number) or (used is not None and channel.name not in used):
            continue
        signal = file.get(group=number, index=index)
        clock = np.asarray(signal.timestamps, np.float64)
        kind = signal.samples.dtype.kind
        found = listed(channel.name, signal.samples) if kind in "fiub" else {}
        columns |= found
        units |= dict.fromkeys(found, signal.unit) if signal.unit else {}
        if kind in "SU" and signal.samples.ndim == 1:
            cells = signal.samples.astype("S" if kind == "S" else "U")
            texts[channel.name] = [c.decode("utf-8", "replace") if kind == "S" else str(c) for c in cells]
    return Table(name, columns, units, texts, {}, clock)
