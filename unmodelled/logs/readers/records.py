"""Tables from records: messages of a topic or objects of a list, each with fields inside fields."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, MutableSequence, Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unmodelled.base.arrays import Array
from unmodelled.base.limits import fits
from unmodelled.logs.readers.names import (
    NAMING,
    PUBLISHER,
    Beside,
    Labels,
    by_name,
    by_publisher,
    elements,
    labels_of,
)
from unmodelled.logs.readers.reader import Table

#: Longest list whose elements are columns: what is longer is an image, a scan or a cloud of points.
ELEMENTS = 64
#: Deepest field inside fields.
DEPTH = 8

#: Bytes of a cell while the columns of a table are made, by name the second time.
CELL = 16

#: Fields of a time stamp of ROS: seconds and nanoseconds.
STAMPS = (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"))

Fields = Callable[[Any], Mapping[str, Any] | None]


def _mapping(value: Any) -> Mapping[str, Any] | None:
    return value if isinstance(value, Mapping) else None


class Records:
    """Columns of one table that grows by a record at a time; `fields` gives those of a value, or None."""

    def __init__(self, name: str, fields: Fields = _mapping) -> None:
        self._name, self._fields = name, fields
        self._numbers: dict[
            str, tuple[MutableSequence[int], MutableSequence[float]]
        ] = {}  # rows of a column, and its values
        self._texts: dict[str, tuple[MutableSequence[int], list[str]]] = {}
        self._clock: list[float] = []
        self._labels: list[Labels] = []
        self._publishers: list[str] = []
        self._known: dict[Labels, Labels] = {}

    def add(self, record: Any, t: float | None = None, publisher: str = "") -> None:
        """Add a record."""
        found = _Row(self._fields)
        found.add("", record, 0)
        for name, number in found.numbers.items():
            rows, numbers = self._numbers.setdefault(name, (array("q"), array("d")))
            rows.append(len(self))
            numbers.append(number)
        for name, text in found.texts.items():
            rows, texts = self._texts.setdefault(name, (array("q"), []))
            rows.append(len(self))
            texts.append(text)
        labels = found.labels()
        self._labels.append(self._known.setdefault(labels, labels))
        self._publishers.append(publisher)
        if t is not None:
            self._clock.append(t)

    def __len__(self) -> int:
        return len(self._labels)

    def tables(self) -> list[Table]:
        """Return the table of all records, one for each publisher that names other things; none if empty."""
        cells = len(self) * (len(self._numbers) + len(self._texts))
        if not fits(CELL * cells):
            raise MemoryError
        numbers = {name: np.full(len(self), np.nan) for name in self._numbers}
        for name, (rows, values) in self._numbers.items():
            numbers[name][np.asarray(rows)] = values
        texts = {name: [""] * len(self) for name in self._texts}
        for name, (rows, words) in self._texts.items():
            for row, word in zip(rows, words, strict=True):
                texts[name][row] = word
        if not numbers and not texts:
            return []
        clock = np.array(self._clock) if self._clock else None
        table = Table(self._name, numbers, {}, texts, {}, clock)
        return by_publisher(table, self._labels, self._publishers)


class _Row:
    """Numbers and texts of one record, with the names that stand beside its lists."""

    def __init__(self, fields: Fields) -> None:
        self._fields = fields
        self.numbers: dict[str, float] = {}
        self.texts: dict[str, str] = {}
        self._names: dict[str, list[str]] = {}
        self._lengths: dict[str, int] = {}
        self._own: dict[str, tuple[str, ...]] = {}

    def add(self, name: str, value: Any, depth: int) -> None:
        """Add a value at a place, and what is inside it."""
        inner = self._fields(value)
        if inner is not None:
            if (stamp := _stamp(inner)) is not inner and name:
                self.add(name, stamp, depth)
            for key, field in inner.items() if depth < DEPTH else ():
                self.add(f"{name}.{key}" if name else str(key), field, depth + 1)
        elif isinstance(value, str):
            self.texts[name] = value
        elif isinstance(value, Real | np.generic):
            self.numbers[name] = _number(value)
        elif isinstance(value, list | tuple | np.ndarray) and 0 < len(value) <= ELEMENTS:
            self._add_elements(name, list(value), depth)

    def _add_elements(self, name: str, values: list[Any], depth: int) -> None:
        if all(isinstance(value, str) for value in values):
            self._names[name] = values
            return
        self._lengths[name] = len(values)
        if (first := self._fields(values[0])) is not None and (own := self._names_inside(first, values)):
            self._own[name] = own
        for k, value in enumerate(values):
            self.add(f"{name}[{k}]", value, depth + 1)

    def _names_inside(self, first: Mapping[str, Any], values: list[Any]) -> tuple[str, ...]:
        """Names of the elements of a list of things that have one each: `[{name: hip, position: 0.1}]`."""
        key = next((k for k, v in first.items() if isinstance(v, str) and NAMING.fullmatch(str(k))), None)
        names = tuple(str((self._fields(value) or {}).get(key, "")) for value in values) if key else ()
        return names if all(names) and len(set(names)) == len(names) else ()

    def labels(self) -> Labels:
        """Return the names of the elements of its lists."""
        beside = dict(labels_of(self._names, self._lengths)) if self._names else {}
        return tuple({**beside, **self._own}.items())


def _number(value: Any) -> float:
    try:
        return float(value)
    except (OverflowError, TypeError, ValueError):
        return np.nan


def listed(name: str, values: NDArray[Any]) -> dict[str, Array]:
    """Return the columns of an array (rows,), which is one, or (rows, elements), which are `name[0]`, ..."""
    if values.ndim == 1:
        return {name: values.astype(np.float64)}
    if values.ndim != 2 or values.shape[1] > ELEMENTS:
        return {}
    return {f"{name}[{k}]": values[:, k].astype(np.float64) for k in range(values.shape[1])}


def is_wanted(topic: str, wanted: Sequence[str] | None) -> bool:
    """Return whether a topic must be read."""
    if wanted is None or not all(name.startswith("/") for name in wanted):
        return True
    return any(name.startswith((f"{topic}.", f"{topic}{PUBLISHER}")) for name in wanted)


def tables_by_length(
    name: str,
    arrays: Mapping[str, NDArray[Any]],
    units: Mapping[str, str],
    texts: Mapping[str, str],
    names: Mapping[str, Sequence[Any]] | None = None,
) -> list[Table]:
    """Return the tables of arrays (rows, ...) at one place, one for every length; the longer axis is time."""
    found: dict[int, dict[str, Array]] = {1: {}} if texts else {}
    given: dict[str, str] = {}
    for key, values in arrays.items():
        upright = np.atleast_1d(
            values.T if values.ndim == 2 and values.shape[0] < values.shape[1] else values
        )
        flat = upright[:, 0] if upright.ndim == 2 and upright.shape[1] == 1 else upright
        columns = listed(key, flat) if flat.ndim < 3 and len(flat) else {}
        if columns:
            found.setdefault(len(flat), {}).update(columns)
            given |= dict.fromkeys(columns, units[key]) if key in units else {}
    made = []
    for length, columns in found.items():
        own = {key: given[key] for key in columns if key in given}
        single = {key: (text,) for key, text in texts.items()} if length == 1 else {}
        table, beside = Table(name, columns, own, single), Beside()
        rows = {key: words for key, words in (names or {}).items() if not isinstance(words[0], str)}
        beside.names |= {k: [tuple(map(str, row)) for row in v] for k, v in rows.items() if len(v) == length}
        whole = {key: words for key, words in (names or {}).items() if key not in rows}
        lengths = {place: len(parts) for place, parts in elements(columns).items()}
        made += by_name(table, beside.labels(table)[0] if beside.names else [labels_of(whole, lengths)])
    return made


def message_fields(message: Any) -> Mapping[str, Any] | None:
    """Return the fields of a message of ROS; a time stamp is a number, in s."""
    names = getattr(message, "__dataclass_fields__", None) or getattr(type(message), "__slots__", None)
    if isinstance(message, Mapping):
        names = message
    if not names or isinstance(message, str | int | float | list | tuple | np.ndarray | np.generic):
        return None
    fields = {
        name: message[name] if isinstance(message, Mapping) else getattr(message, name)
        for name in names
        if not name.startswith("__")
    }
    return {name: _stamp(field) for name, field in fields.items()}


def _stamp(field: Any) -> Any:
    """A time stamp in s; any other field as it is."""
    for second, rest in STAMPS:
        pair = (_member(field, second), _member(field, rest))
        if None not in pair:
            return pair[0] + 1e-9 * pair[1]
    return field


def _member(field: Any, name: str) -> Any:
    return field.get(name) if isinstance(field, Mapping) else getattr(field, name, None)
