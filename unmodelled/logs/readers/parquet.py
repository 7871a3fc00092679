"""Read Parquet files, with lists in cells and the names that a LeRobot data set gives to their elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.arrays import Array
from unmodelled.base.files import read_json
from unmodelled.base.limits import check_memory
from unmodelled.logs.readers.names import Beside, by_cells
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import ELEMENTS, STAMPS, listed
from unmodelled.logs.recognition import Source

#: Where a LeRobot data set says what its columns hold, seen from a folder above its Parquet files.
INFO = Path("meta") / "info.json"
#: Folders above a file in which that is looked for.
ABOVE = 4
#: Ticks in a second, by unit of a time in Arrow; bytes of a text in memory, beside its characters.
TICKS, TEXT = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}, 60


class Parquet(Reader):
    """Reader of Parquet files."""

    name = "Parquet"
    install = "pyarrow"
    isolated = False

    def recognises(self, path: Path, start: bytes) -> bool:
        return Source(path, start).is_parquet

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        from unmodelled.base.parquet import read_arrow, read_schema

        names = [field.name for field in read_schema(path) if not _is_bytes(field.type)]
        # a reference to a column may go on with an element or a field of it
        read = [n for n in names if wanted is None or any(_is_of(w, n) for w in wanted)] or names
        aliases = _elements(path)
        if wanted is not None and not set(wanted) <= {*names, *aliases}:
            read = names
        content = _Content(path)
        for field, column in zip((table := read_arrow(path, read)).schema, table.columns, strict=True):
            content.add(field.name, column.combine_chunks())
            unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
            own = [name for name in content.columns if unit and _is_of(name, field.name)]
            content.units |= dict.fromkeys(own, unit)
        known = {alias: name for alias, name in aliases.items() if name in content.columns}
        found = Table("", content.columns, content.units, content.texts, known, origins=content.origins)
        return by_cells(found, content.beside)


def _is_of(wanted: str, name: str) -> bool:
    return wanted == name or wanted.startswith((f"{name}[", f"{name}."))


class _Content:
    """Columns of a Parquet file, taken from Arrow arrays."""

    def __init__(self, path: Path) -> None:
        self.path, self.beside = path, Beside()
        self.columns: dict[str, Array] = {}
        self.texts: dict[str, Sequence[str]] = {}
        self.units: dict[str, str] = {}
        self.origins: dict[str, int] = {}

    def add(self, name: str, column: Any) -> None:
        """Add the numbers or texts in an Arrow array, and in the fields and lists inside it."""
        import pyarrow as pa

        kind, is_a = column.type, pa.types
        if is_a.is_struct(kind):
            for k, inner in enumerate(column.flatten()):  # empty where the struct is
                self.add(f"{name}.{kind.field(k).name}", inner)
            for second, rest in STAMPS:
                if (pair := (f"{name}.{second}", f"{name}.{rest}")) and set(pair) <= set(self.columns):
                    self.columns[name] = self.columns[pair[0]] + 1e-9 * self.columns[pair[1]]
        elif is_a.is_timestamp(kind) or is_a.is_duration(kind) or is_a.is_time(kind):
            ticks = column.cast(pa.int32() if is_a.is_time32(kind) else pa.int64())
            self.columns[name], self.origins[name] = _seconds(ticks, kind.unit)
            self.units[name] = "s"
        elif is_a.is_list(kind) or is_a.is_large_list(kind) or is_a.is_fixed_size_list(kind):
            self._add_lists(name, column)
        elif _is_number(kind):
            self.columns[name] = column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
        elif _is_text(kind.value_type if is_a.is_dictionary(kind) else kind):
            self.texts[name] = self._words(name, column).tolist()

    def _add_lists(self, name: str, column: Any) -> None:
        """Add the elements of lists, a column for each of them."""
        import pyarrow as pa
        import pyarrow.compute as pc

        lengths = (
            pc.fill_null(pc.list_value_length(column), 0).to_numpy(zero_copy_only=False).astype(np.int64)
        )
        width, inner = int(lengths.max(initial=0)), column.type.value_type
        if not 0 < width <= ELEMENTS:
            return
        check_memory(f"{self.path}: column {name}", 16.0 * width * len(lengths))
        filled = np.arange(width) < lengths[:, None]
        if _is_number(inner):
            flat = pc.list_flatten(column).cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
            if filled.all():
                values = flat.reshape(-1, width)
            else:
                values = np.full(filled.shape, np.nan)
                values[filled] = flat
            self.columns |= listed(name, values)
            self.beside.lengths[name] = lengths.tolist()
        elif _is_text(inner):
            words = np.full(filled.shape, "", object)
            words[filled] = self._words(name, pc.list_flatten(column))
            self.beside.names[name] = [tuple(row[:n]) for row, n in zip(words.tolist(), lengths, strict=True)]

    def _words(self, name: str, column: Any) -> NDArray[np.object_]:
        """Texts, each of which is in memory once; "" where there is none."""
        coded = column.dictionary_encode()  # what is so already stays
        check_memory(f"{self.path}: column {name}", TEXT * len(coded.dictionary) + 16.0 * len(coded))
        words = np.array([*coded.dictionary.to_pylist(), ""], object)
        return np.asarray(words[coded.indices.fill_null(len(words) - 1).to_numpy(zero_copy_only=False)])


def _is_number(kind: Any) -> bool:
    import pyarrow as pa

    of = pa.types
    return any(is_a(kind) for is_a in (of.is_boolean, of.is_integer, of.is_floating, of.is_decimal))


def _is_bytes(kind: Any) -> bool:
    """Whether cells hold bytes, such as pictures, which are no numbers and can be far larger than them."""
    import pyarrow as pa

    of = pa.types
    if of.is_struct(kind):
        return any(_is_bytes(field.type) for field in kind)
    return any(is_a(kind) for is_a in (of.is_binary, of.is_large_binary, of.is_fixed_size_binary))


def _is_text(kind: Any) -> bool:
    import pyarrow as pa

    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _seconds(ticks: Any, unit: str) -> tuple[Array, int]:
    """Ticks since the first one in s, subtracted as integers, which have more digits, and that one in ns."""
    import pyarrow.compute as pc

    first = pc.min(ticks)
    since = pc.subtract(ticks, first) if first.is_valid else ticks
    zero = first.as_py() * round(1e9 / TICKS[unit]) if first.is_valid else 0
    return np.asarray(since.to_numpy(zero_copy_only=False), np.float64) / TICKS[unit], zero


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
