"""Read JSON files: lists of records, objects of columns, and one record per line."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from numbers import Real
from pathlib import Path
from typing import Any

from unmodelled.base.limits import OBJECTS, check_file
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import ELEMENTS, Records


class JsonRecords(Reader):
    """Reader of JSON files: a list of objects is a table, and so is an object of lists of numbers."""

    name = "JSON"
    install = ""
    isolated = False

    def recognises(self, path: Path, start: bytes) -> bool:
        endings = (".json", ".jsonl", ".ndjson")
        return path.suffix.lower() in endings and start.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] in (b"{", b"[")

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        check_file(path, OBJECTS)
        text = path.read_text(encoding="utf-8-sig")
        try:
            content = json.loads(text)
        except json.JSONDecodeError as error:
            if not error.msg.startswith("Extra data"):
                raise
            content = [json.loads(line) for line in text.splitlines() if line.strip()]
        return list(_tables("", content))


def _tables(place: str, content: Any) -> Iterator[Table]:
    """The tables at a place of a file and below it, and the single values there as a row."""
    if isinstance(content, list):
        records = Records(place)
        for record in content if all(isinstance(record, dict) for record in content) else ():
            records.add(record)
        yield from records.tables()
        return
    inner = {key: value for key, value in content.items() if _is_table(value)}
    lists = {key: value for key, value in content.items() if _is_column(value)}
    single = {key: value for key, value in content.items() if key not in inner and key not in lists}
    names = {key: value for key, value in single.items() if _is_names(value)}
    alike: dict[int, list[str]] = {}
    for key, value in lists.items():
        alike.setdefault(len(value), []).append(key)
    for length, keys in alike.items():
        records = Records(place)
        for k in range(length):
            records.add({**names, **{key: lists[key][k] for key in keys}})
        yield from records.tables()
    other = Records(place)
    other.add(single)
    yield from other.tables()
    for key, value in inner.items():
        yield from _tables(f"{place}.{key}" if place else str(key), value)


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and all(isinstance(record, dict) for record in value)
    )


def _is_names(value: Any) -> bool:
    """Whether a value is a list of texts, which may name the elements of lists in every row."""
    return (
        isinstance(value, list)
        and 0 < len(value) <= ELEMENTS
        and all(isinstance(cell, str) for cell in value)
    )


def _is_column(value: Any) -> bool:
    """Whether a value is a column: a list of numbers, or of equally long lists of numbers."""
    if not isinstance(value, list) or len(value) < 2:
        return False
    if all(isinstance(cell, list) for cell in value):
        return len({len(cell) for cell in value}) == 1
    return all(cell is None or isinstance(cell, Real) for cell in value)
