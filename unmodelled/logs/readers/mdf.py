"""Read MDF files (measurement data format, versions 2 to 4) with asammdf."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import listed


class Mdf(Reader):
    """Reader of MDF files: every channel group is a table with the clock of its master channel."""

    name = "MDF"
    install = "asammdf"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith((b"MDF     ", b"UnFinMF "))

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from asammdf import MDF

        with MDF(path) as file:
            channels = [channel for group in file.groups for channel in group.channels]
            names = {channel.name for channel in channels}
            used = None if wanted is None else {n for n in names if any(_is_of(w, n) for w in wanted)}
            if used is not None and not all(any(_is_of(w, n) for n in used) for w in wanted or ()):
                used = None  # some are names of other formats or misspelt: all are needed to say so
            formulas = {channel.name for channel in channels if _has_formula(channel.conversion)}
            if refused := sorted(formulas & (used or set())):
                raise BadInput(
                    f"{path}: channel {refused[0]!r} is converted by a formula in the file, which is not "
                    "executed: export the file with converted values"
                )
            read = (names if used is None else used) - formulas
            found = [_table(file, number, read) for number in range(len(file.groups))]
        return [table for table in found if table.columns or table.texts]


def _has_formula(conversion: Any) -> bool:
    """Whether a conversion, or one that it refers to, is a formula: asammdf has Python evaluate it."""
    inner = getattr(conversion, "referenced_blocks", None) or {}
    return bool(getattr(conversion, "formula", "")) or any(map(_has_formula, inner.values()))


def _is_of(wanted: str, name: str) -> bool:
    """Whether a name in a mapping may be that of a channel, or of an element of it."""
    return f".{wanted}".endswith(f".{name}") or f".{name}[" in f".{wanted}"


def _table(file: Any, number: int, read: set[str]) -> Table:
    """The channels of a group that are read, with the time of its master channel."""
    group, master = file.groups[number], file.masters_db.get(number)
    if master is not None and _has_formula(group.channels[master].conversion):
        return Table("", {})
    called = str(group.channel_group.acq_name or "").strip()
    name = "" if len(file.groups) == 1 else called or f"group{number}"
    columns: dict[str, Array] = {}
    texts: dict[str, list[str]] = {}
    units: dict[str, str] = {}
    clock: Array | None = None
    for index, channel in enumerate(group.channels):
        if index == master or channel.name not in read:
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
