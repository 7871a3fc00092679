"""Read WPILOG files of FRC robots with wpiutil."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import Records

MICRO = 1e6
#: What gives the value of a record, by the type of its entry.
VALUES: Mapping[str, Callable[[Any], Any]] = {
    "double": lambda record: record.getDouble(),
    "float": lambda record: record.getFloat(),
    "int64": lambda record: record.getInteger(),
    "boolean": lambda record: record.getBoolean(),
    "string": lambda record: record.getString(),
    "double[]": lambda record: record.getDoubleArray(),
    "float[]": lambda record: record.getFloatArray(),
    "int64[]": lambda record: record.getIntegerArray(),
    "boolean[]": lambda record: record.getBooleanArray(),
}
#: Name of the column of an entry.
VALUE = "value"


class WpiLog(Reader):
    """Reader of WPILOG files: every entry is a table, with the times of its values since the first one."""

    name = "WPILOG"
    install = "robotpy-wpiutil"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith(b"WPILOG")

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from wpiutil.log import DataLogReader

        file = DataLogReader(str(path))
        if not file.isValid():
            raise BadInput(f"{path}: not in format {self.name}, or damaged: its head cannot be read")
        entries: dict[int, tuple[Records, Callable[[Any], Any]]] = {}
        tables: dict[str, Records] = {}
        first: int | None = None
        for record in file:
            if record.isStart():
                started = record.getStartData()
                if started.type in VALUES:
                    records = tables.setdefault(started.name, Records(started.name))
                    entries[started.entry] = records, VALUES[started.type]
            elif not record.isControl() and record.getEntry() in entries:
                records, value = entries[record.getEntry()]
                first = record.getTimestamp() if first is None else first
                records.add({VALUE: value(record)}, (record.getTimestamp() - first) / MICRO)
        return [table for records in tables.values() for table in records.tables()]
