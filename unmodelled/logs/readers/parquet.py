"""Read Parquet files, with lists in cells and the names that a LeRobot data set gives to their elements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from unmodelled.base.files import read_json
from unmodelled.logs.readers.reader import Array, Reader, Table
from unmodelled.logs.readers.records import ELEMENTS, listed

#: Where a LeRobot data set says what its columns hold, seen from a folder above its Parquet files.
INFO = Path("meta") / "info.json"
#: Folders above a file in which that is looked for.
ABOVE = 4


class Parquet(Reader):
    """Reader of Parquet files."""

    name = "Parquet"
    install = "pyarrow"
    isolated = False

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith(b"PAR1")

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from unmodelled.base.parquet import column_names, read_arrow

        names = column_names(path)
        # a reference to a column may go on with an element or a field of it
        read = [n for n in names if wanted is None or any(_is_of(w, n) for w in wanted)] or names
        aliases = _elements(path)
        if wanted is not None and not set(wanted) <= {*names, *aliases}:
            read = names
        table = read_arrow(path, read)
        columns: dict[str, Array] = {}
        texts: dict[str, Sequence[str]] = {}
        units: dict[str, str] = {}
        for field, column in zip(table.schema, table.columns, strict=True):
            found = dict(_columns(field.name, column.combine_chunks()))
            columns |= {name: values for name, values in found.items() if isinstance(values, np.ndarray)}
            texts |= {name: values for name, values in found.items() if isinstance(values, list)}
            unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
            units |= dict.fromkeys(found, unit) if unit else {}
            units |= dict.fromkeys(found, "s") if "time" in str(field.type) else {}
        known = {alias: name for alias, name in aliases.items() if name in columns}
        return [Table("", columns, units, texts, known)]


def _is_of(wanted: str, name: str) -> bool:
    return wanted == name or wanted.startswith((f"{name}[", f"{name}."))


def _columns(name: str, column: Any) -> Iterator[tuple[str, Array | list[str]]]:
    """Numbers or texts in an Arrow array, by name of a column."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_struct(kind):
        for k in range(kind.num_fields):
            inner = kind.field(k).name
            yield from _columns(f"{name}.{inner}", column.field(k))
    elif pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
        ticks = column.cast(pa.int64()).to_numpy(zero_copy_only=False).astype(np.float64)
        second = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[kind.unit]
        yield name, (ticks - np.nanmin(ticks)) / second
    elif pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind):
        rows = column.to_pylist()
        widths = {len(row) for row in rows if row is not None}
        if len(widths) == 1 and max(widths) <= ELEMENTS and not pa.types.is_nested(kind.value_type):
            empty = [None] * max(widths)
            values = np.array([empty if row is None else row for row in rows])
            if values.dtype.kind in "fiubO":
                yield from listed(name, values.astype(np.float64)).items()
    elif pa.types.is_boolean(kind) or pa.types.is_integer(kind) or pa.types.is_floating(kind):
        yield name, column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    elif pa.types.is_string(kind) or pa.types.is_large_string(kind):
        yield name, [cell or "" for cell in column.to_pylist()]


def _elements(path: Path) -> dict[str, str]:
    """Names that a LeRobot data set gives to elements of lists: `state[hip]` -> `state[0]`."""
    info = next((p / INFO for p in list(path.absolute().parents)[:ABOVE] if (p / INFO).is_file()), None)
    content = read_json(info) if info is not None else {}
    features = content.get("features") if isinstance(content, dict) else None
    found: dict[str, str] = {}
    for column, feature in features.items() if isinstance(features, dict) else ():
        names = feature.get("names") if isinstance(feature, dict) else None
        for k, name in enumerate(_flat(names)):
            found[f"{column}[{name}]"] = f"{column}[{k}]"
    return found


def _flat(names: Any) -> list[str]:
    """A list of names, or the lists in a mapping of groups of motors one after the other."""
    if isinstance(names, Mapping):
        return [name for group in names.values() for name in _flat(group)]
    return [str(name) for name in names] if isinstance(names, list) else []
