"""Read JSON files: lists of records, objects of columns, and one record per line."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from numbers import Real
from pathlib import Path
from typing import Any

from unmodelled.base.limits import OBJECTS, check_file
from unmodelled.logs.readers.reader import Reader, Table
from unmodelled.logs.readers.records import Records


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
    for length in {len(value) for value in lists.values()}:
        records = Records(place)
        for k in range(length):
            records.add({key: value[k] for key, value in lists.items() if len(value) == length})
        yield from records.tables()
    single = Records(place)
    single.add({key: value for key, value in content.items() if key not in inner and key not in lists})
    yield from single.tables()
    for key, value in inner.items():
        yield from _tables(f"{place}.{key}" if place else str(key), value)


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and all(isinstance(record, dict) for record in value)
    )


def _is_column(value: Any) -> bool:
    """Whether a value is a column: a list of numbers, or of equally long lists of numbers."""
    if not isinstance(value, list) or len(value) < 2:
        return False
    if all(isinstance(cell, list) for cell in value):
        return len({len(cell) for cell in value}) == 1
    return all(cell is None or isinstance(cell, Real) for cell in value)
