"""Read MAT files up to version 7: variables, and structs inside structs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import tables_by_length


class Mat(Reader):
    """Reader of MAT files up to version 7: every struct is a table."""

    name = "MAT"
    install = "scipy"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith(b"MATLAB 5.0 MAT-file") or (bool(start) and path.suffix.lower() == ".mat")

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from scipy.io import loadmat

        variables = loadmat(path, appendmat=False, simplify_cells=True)
        return list(_tables("", {k: v for k, v in variables.items() if not k.startswith("__")}))


def _tables(place: str, struct: dict[str, Any]) -> Iterator[Table]:
    arrays: dict[str, NDArray[Any]] = {}
    texts: dict[str, str] = {}
    words: dict[str, list[str]] = {}
    inner: dict[str, dict[str, Any]] = {}
    for name, value in struct.items():
        below = f"{place}.{name}" if place else name
        if isinstance(value, dict):
            inner[below] = value
        elif isinstance(value, str):
            texts[name] = value
        elif np.asarray(value).dtype.kind in "fiub" and np.size(value):
            arrays[name] = np.asarray(value)
        elif isinstance(value, list | np.ndarray):  # an array of structs
            cells = np.ravel(np.asarray(value, object))
            inner |= {f"{below}[{k}]": cell for k, cell in enumerate(cells) if isinstance(cell, dict)}
            words |= {name: cells.tolist()} if all(isinstance(cell, str) for cell in cells) else {}
    yield from tables_by_length(place, arrays, {}, texts, words)
    for below, value in inner.items():
        yield from _tables(below, value)
