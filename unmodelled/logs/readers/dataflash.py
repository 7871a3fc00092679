"""Read binary logs of ArduPilot (DataFlash) with pymavlink."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from unmodelled.logs.readers.long import clock_of
from unmodelled.logs.readers.messages import DEFINING
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import Records


class DataFlash(Reader):
    """Reader of DataFlash logs: every message is a table, those of several sensors told apart by a number."""

    name = "DataFlash"
    install = "pymavlink"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith(b"\xa3\x95\x80")

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from pymavlink.DFReader import DFReader_binary

        file, records, units = DFReader_binary(str(path)), dict[str, Records](), dict[str, dict[str, str]]()
        while (message := file.recv_msg()) is not None:
            kind, form = message.get_type(), message.fmt
            if kind in DEFINING or not _is_wanted(kind, wanted):
                continue
            number = getattr(message, form.instance_field) if form.instance_field else 0
            name = f"{kind}_{number}" if number else kind
            if name not in records:
                records[name] = Records(name)
                units[name] = {c: unit for c in form.columns if (unit := form.get_unit(c))}
            records[name].add({column: getattr(message, column) for column in form.columns})
        found = [table for each in records.values() for table in each.tables()]
        return [replace(t, units=units[t.name], clock=clock_of(t)) for t in found]


def _is_wanted(kind: str, wanted: Sequence[str] | None) -> bool:
    """Whether columns of a message, or of one of its sensors, are used; yes where a name tells no message."""
    heads = [name.partition(".") for name in wanted or ("",)]
    return any(not dot or head == kind or head.startswith(f"{kind}_") for head, dot, _ in heads)
