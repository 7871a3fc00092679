"""Read ULog files of PX4 with pyulog."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from unmodelled.logs.readers.reader import Reader, Table

#: Column with the time of every message, and microseconds in a second.
STAMP, MICRO = "timestamp", 1e6


class ULog(Reader):
    """Reader of ULog files: every message is a table, several instances of one are told apart by a number."""

    name = "ULog"
    install = "pyulog"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith(b"ULog\x01\x12\x35")

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from pyulog import ULog as File

        found = []
        for data in File(str(path)).data_list:
            name = f"{data.name}_{data.multi_id}" if data.multi_id else data.name
            columns = {k: np.asarray(v, np.float64) for k, v in data.data.items() if k != STAMP}
            clock = np.asarray(data.data[STAMP], np.float64) / MICRO
            found.append(Table(name, columns, clock=clock))
        return found
