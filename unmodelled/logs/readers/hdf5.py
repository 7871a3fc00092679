"""Read HDF5 files with any groups and datasets, MAT files of version 7.3 among them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.limits import check_memory
from unmodelled.logs.hdf5 import needs_plugin
from unmodelled.logs.readers.names import NAMING
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import ELEMENTS, tables_by_length
from unmodelled.logs.recognition import Source

#: Attributes that give the unit of a dataset.
UNITS = ("unit", "units")
#: Deepest group.
DEPTH = 8


class Hdf5(Reader):
    """Reader of HDF5 files: every group is a table; nothing outside the file is followed."""

    name = "HDF5"
    install = "h5py"
    isolated = True

    def recognises(self, path: Path, start: bytes) -> bool:
        return Source(path, start).is_hdf5

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        import h5py

        with h5py.File(path, "r") as file:
            return list(_tables(path, "", file, 0))


def _tables(path: Path, place: str, group: Any, depth: int) -> Iterator[Table]:
    import h5py

    arrays: dict[str, NDArray[Any]] = {}
    units: dict[str, str] = {}
    texts: dict[str, str] = {}
    words: dict[str, Any] = {}
    inner: dict[str, Any] = {}
    for name in group:
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue  # MATLAB's own objects; links
        member = group[name]
        if isinstance(member, h5py.Group):
            inner[name] = member
        elif _is_plain(member):
            check_memory(f"{path}: {name}", 8.0 * member.size)
            arrays[name] = np.asarray(member[...])
            unit = next((_text(member.attrs[key]) for key in UNITS if key in member.attrs), None)
            units |= {name: unit} if unit else {}
        elif NAMING.fullmatch(name) and (found := _words(member)):
            words[name] = found
    for name, value in group.attrs.items():
        if name.startswith(("MATLAB_", "H5PATH")):
            continue
        if (text := _text(value)) is not None:
            texts[name] = text
        elif NAMING.fullmatch(name) and (found := _words(value)):
            words[name] = found
        elif np.size(value) == 1 and np.asarray(value).dtype.kind in "fiub" and name not in arrays:
            arrays[name] = np.ravel(value)
    yield from tables_by_length(place, arrays, units, texts, words)
    for name, member in inner.items() if depth < DEPTH else ():
        yield from _tables(path, f"{place}/{name}" if place else name, member, depth + 1)


def _is_plain(dataset: Any) -> bool:
    """Whether a dataset holds numbers of one or two axes in the file itself, without a plug-in."""
    import h5py

    if not isinstance(dataset, h5py.Dataset) or dataset.dtype.kind not in "fiub":
        return False
    if dataset.attrs.get("MATLAB_class") in (b"char", b"cell") or dataset.shape is None:
        return False
    if dataset.is_virtual or dataset.external or needs_plugin(dataset):
        return False
    return len(dataset.shape) <= 2 and math.prod(dataset.shape) > 0


def _words(value: Any) -> list[str]:
    """The texts of a short dataset or attribute with one axis; none if it holds others, or lies elsewhere."""
    import h5py

    if isinstance(value, h5py.Dataset):
        short = value.dtype.kind in "OS" and value.shape is not None and len(value.shape) == 1
        if not (short and value.size <= ELEMENTS) or value.is_virtual or value.external:
            return []
        value = value[...]
    if np.ndim(value) != 1 or np.size(value) > ELEMENTS:
        return []
    found = [_text(each) for each in np.asarray(value, object)]
    return [text for text in found if text is not None] if None not in found else []


def _text(value: Any) -> str | None:
    found = value.item() if isinstance(value, np.generic | np.ndarray) and np.size(value) == 1 else value
    if isinstance(found, bytes):
        return found.decode("utf-8", "replace")
    return found if isinstance(found, str) else None
