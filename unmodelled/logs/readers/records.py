"""Tables from records: messages of a topic or objects of a list, each with fields inside fields."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unmodelled.logs.readers.reader import Array, Table

#: Longest list whose elements are columns: what is longer is an image, a scan or a cloud of points.
ELEMENTS = 64
#: Deepest field inside fields.
DEPTH = 8

#: Fields of a time stamp of ROS: seconds and nanoseconds.
STAMPS = (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"))

Fields = Callable[[Any], Mapping[str, Any] | None]


def _mapping(value: Any) -> Mapping[str, Any] | None:
    return value if isinstance(value, Mapping) else None


class Records:
    """Columns of one table that grows by a record at a time.

    Args:
        name: name of the table.
        fields: function that returns the fields of a value, None for a value that has none; default: those of
            a mapping.

    Examples:
        >>> joints = Records("/joints")
        >>> joints.add({"name": ["hip", "knee"], "position": [0.1, 0.2]}, 0.0)
        >>> joints.add({"name": ["hip", "knee"], "position": [0.3, 0.4]}, 0.5)
        >>> (table,) = joints.tables()
        >>> table.columns["position[1]"].tolist(), table.aliases["position[knee]"], table.clock.tolist()
        ([0.2, 0.4], 'position[1]', [0.0, 0.5])
    """

    def __init__(self, name: str, fields: Fields = _mapping) -> None:
        self._name, self._fields = name, fields
        self._numbers: dict[str, list[float]] = {}
        self._texts: dict[str, list[str]] = {}
        self._clock: list[float] = []
        self._names: dict[str, list[str]] = {}
        self._count = 0

    def add(self, record: Any, t: float | None = None) -> None:
        """Add a record.

        Args:
            record: numbers, texts, lists of them, and fields inside fields.
            t: time of the record, s; None (default) where the format has no clock.
        """
        for name, value in self._flat("", record, 0):
            if isinstance(value, str):
                _extended(self._texts.setdefault(name, []), self._count, "").append(value)
            else:
                _extended(self._numbers.setdefault(name, []), self._count, np.nan).append(value)
        self._count += 1
        if t is not None:
            self._clock.append(t)

    def tables(self) -> list[Table]:
        """Return the table of all records; none if there are no columns."""
        numbers = {k: np.array(_extended(v, self._count, np.nan)) for k, v in self._numbers.items()}
        texts = {name: _extended(column, self._count, "") for name, column in self._texts.items()}
        if not numbers and not texts:
            return []
        clock = np.array(self._clock) if self._clock else None
        return [Table(self._name, numbers, {}, texts, _aliases(self._names, numbers), clock)]

    def _flat(self, name: str, value: Any, depth: int) -> Iterator[tuple[str, float | str]]:
        inner = self._fields(value)
        if inner is not None:
            if depth < DEPTH:
                for key, field in inner.items():
                    yield from self._flat(f"{name}.{key}" if name else str(key), field, depth + 1)
        elif isinstance(value, str):
            yield name, value
        elif isinstance(value, Real | np.generic):
            yield name, _number(value)
        elif isinstance(value, list | tuple | np.ndarray) and len(value) <= ELEMENTS:
            yield from self._elements(name, list(value), depth)

    def _elements(self, name: str, values: list[Any], depth: int) -> Iterator[tuple[str, float | str]]:
        if values and all(isinstance(value, str) for value in values):
            self._names.setdefault(name, values)
            return
        for k, value in enumerate(values):
            yield from self._flat(f"{name}[{k}]", value, depth + 1)


def _number(value: Any) -> float:
    try:
        return float(value)
    except (OverflowError, TypeError, ValueError):
        return np.nan


def _extended(column: list[Any], count: int, empty: Any) -> list[Any]:
    """Return a column with an empty cell for every record that it missed."""
    column += [empty] * (count - len(column))
    return column


def _aliases(names: Mapping[str, list[str]], columns: Mapping[str, Array]) -> dict[str, str]:
    """Return names for the elements of lists that stand beside a list of as many texts: `position[knee]`."""
    found: dict[str, str] = {}
    for place, labels in names.items():
        beside = place.rpartition(".")[0]
        lists = {name.rpartition("[")[0] for name in columns if name.endswith("]")}
        for name in (name for name in lists if name.rpartition(".")[0] == beside):
            elements = [column for column in columns if column.rpartition("[")[0] == name]
            if len(elements) == len(labels):
                found |= {f"{name}[{label}]": f"{name}[{k}]" for k, label in enumerate(labels)}
    return found


def listed(name: str, values: NDArray[Any]) -> dict[str, Array]:
    """Return the columns of an array: itself, or one for every element of a row.

    Args:
        name: name of the array.
        values: numbers of shape (rows,) or (rows, elements).

    Returns:
        Columns by name, each of shape (rows,).

    Examples:
        >>> {name: column.tolist() for name, column in listed("q", np.eye(2)).items()}
        {'q[0]': [1.0, 0.0], 'q[1]': [0.0, 1.0]}
    """
    if values.ndim == 1:
        return {name: values.astype(np.float64)}
    if values.ndim != 2 or values.shape[1] > ELEMENTS:
        return {}
    return {f"{name}[{k}]": values[:, k].astype(np.float64) for k in range(values.shape[1])}


def is_wanted(topic: str, wanted: Sequence[str] | None) -> bool:
    """Return whether a topic must be read.

    Args:
        topic: name of the topic, which begins with "/".
        wanted: names of the columns that are used; None: all. A name that does not begin with "/" may be that
            of a column of any topic.
    """
    if wanted is None or not all(name.startswith("/") for name in wanted):
        return True
    return any(name.startswith(f"{topic}.") for name in wanted)


def tables_by_length(
    name: str, arrays: Mapping[str, NDArray[Any]], units: Mapping[str, str], texts: Mapping[str, str]
) -> list[Table]:
    """Return the tables of arrays at one place of a file, one for every length.

    The longer axis of a matrix is time.

    Args:
        name: name of the place.
        arrays: numbers by name, each of shape (rows,), (rows, columns) or (columns, rows).
        units: unit by name of an array, where it has one.
        texts: single texts by name.
    """
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
    return [
        Table(
            name,
            columns,
            {key: given[key] for key in columns if key in given},
            {key: (text,) for key, text in texts.items()} if length == 1 else {},
        )
        for length, columns in found.items()
    ]


def message_fields(message: Any) -> Mapping[str, Any] | None:
    """Return the fields of a message of ROS; a time stamp is a number, in s.

    Args:
        message: message or field; None is returned for numbers, texts and lists.
    """
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
