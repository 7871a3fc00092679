"""Read archives of NumPy arrays (.npz)."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from unmodelled.base.limits import check_memory
from unmodelled.logs.readers.names import NAMING
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import tables_by_length


class Npz(Reader):
    """Reader of archives of NumPy arrays: arrays of equal length are a table."""

    name = "NumPy"
    install = "numpy"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        return path.suffix.lower() == ".npz" and start.startswith(b"PK\x03\x04")

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        with zipfile.ZipFile(path) as archive:
            check_memory(path, sum(member.file_size for member in archive.infolist()))
        with np.load(path) as arrays:  # refuses objects of Python
            found = {name: array for name in arrays.files if (array := arrays[name]).size}
        numbers = {name: array for name, array in found.items() if array.dtype.kind in "fiub"}
        named = {n: array for n, array in found.items() if array.dtype.kind == "U" and NAMING.fullmatch(n)}
        words = {name: array.tolist() for name, array in named.items() if array.ndim}
        return tables_by_length("", numbers, {}, {}, words)
