"""The dialect of a text table: encoding, separator, decimal mark, comments, header and units."""

from __future__ import annotations

import codecs
import csv
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from unmodelled.base.errors import BadInput
from unmodelled.logs.readers.reader import LONGEST, long_name
from unmodelled.logs.recognition import COMMENT
from unmodelled.systems.units import parse_logged

#: Bytes at the beginning of a file by which its dialect is found, and rows of it that count.
SAMPLE, ROWS = 2**17, 400
#: Rows at the end of a file by which its table is told from settings above it.
ENDING = 50
#: Separators of columns, those that stand in numbers and texts themselves last.
SEPARATORS = ("\t", ";", "|", ",", " ")
MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))

NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eEdD][-+]?\d+)?|[-+]?(nan|inf|infinity)", re.ASCII | re.I)
COMMAED = re.compile(r"[-+]?(\d*,\d+)([eE][-+]?\d+)?", re.ASCII)
#: A number with its name: `yaw=1.5`.
NAMED = re.compile(rf"([^\W\d][\w.]*)[=:]({NUMBER.pattern})", re.ASCII | re.I)
#: A frame of a CAN bus, as candump writes it.
FRAME = re.compile(r"(\([\d.]+\)\s+)?\w+\s+[0-9A-F]{3,8}(#|\s+\[\d\])", re.ASCII)
#: A date or a time of day, alone or one after the other.
DATE = re.compile(
    r"(\d{4}-\d\d-\d\d|\d\d?\.\d\d?\.\d{4})?[T ]?(\d\d?:\d\d(:\d\d([.,]\d+)?)?)?\s*(Z|[-+]\d\d:?\d\d)?"
)
#: A name of a column, with spaces behind it, and its unit in brackets.
UNIT = re.compile(r"(?P<name>.*)[\[(](?P<unit>[^\[\]()]*)[\])]\s*")
#: End of the name of an element of a list, which is no unit: `gyro[1]`.
ELEMENT = re.compile(r"\w\[\d+\]\s*$")


@dataclass(frozen=True)
class Dialect:
    """Way in which a text table is written."""

    encoding: str
    separator: str  # " ": any white space
    decimal: str  # "." or ","
    skipped: int  # rows above the first row of values
    names: tuple[str, ...]  # unique; "1", "2", ... where no row names them
    units: dict[str, str]  # by name of a column


def dialect_of(path: Path) -> Dialect:
    """Find the dialect of a text table by its first rows."""
    with path.open("rb") as file:
        raw = file.read(SAMPLE)
        whole = not file.read(1)
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - SAMPLE) // 2 * 2)  # UTF-16 has two bytes a character
        end = file.read()
    encoding = _encoding(raw)
    lines = raw.decode(encoding, "replace").splitlines()
    lines = lines if whole else lines[:-1]  # the last one is cut
    if lines and all(FRAME.match(line.strip()) for line in lines[:ENDING]):
        advice = "decode it by its DBC file, and save the signals as CSV"
        raise BadInput(f"{path}: is a log of CAN frames, not a table: {advice}")
    # settings may be longer than what is looked at: the table is what a file ends with
    last = lines if whole else _decoded(end, raw, encoding).splitlines()[1:-1]
    separator, width = _table_in([line for line in last if _is_row(line)][-ENDING:])
    rows = [split(line, separator) for line in (*lines[:ROWS], *last[-ROWS:]) if _is_row(line)]
    table = [row for row in rows if len(row) == width]
    held = _held(table[-ENDING:])
    above: list[tuple[int, str]] = []
    for k, line in enumerate(lines if whole else _lines(path, encoding)):
        row = split(line, separator) if _is_row(line) else []
        if held and len(row) == width and _holds(row, held):
            break
        above += [(k, line)] if line.strip() else []
    else:
        raise BadInput(f"{path}: row 1: no row of numbers was found: leave the file out")
    names, units = _named(path, _head(above, k, separator, width), width)
    values = [cell for row in [row, *table] for cell in row]
    decimal = "," if separator != "," and any(COMMAED.fullmatch(cell) for cell in values) else "."
    return Dialect(encoding, separator, decimal, k, names, units)


def _is_row(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith(COMMENT)


def _decoded(end: bytes, start: bytes, encoding: str) -> str:
    """The last bytes of a file as text; those of UTF-16 have no mark of their own."""
    marks = (mark for mark, name in MARKS if name == encoding == "utf-16" and start.startswith(mark))
    return (next(marks, b"") + end).decode(encoding, "replace")


def _lines(path: Path, encoding: str) -> Iterator[str]:
    with path.open(encoding=encoding, errors="replace") as file:
        yield from file


def split(line: str, separator: str) -> list[str]:
    """Return the cells of a line, stripped."""
    if separator == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]


def is_value(cell: str) -> bool:
    """Return whether a cell holds a value: a number, a time, a list of numbers or a word for a truth."""
    return bool(
        NUMBER.fullmatch(cell)
        or COMMAED.fullmatch(cell)
        or NAMED.fullmatch(cell)
        or (cell[:1].isdigit() and DATE.fullmatch(cell))
        or (cell[:1] == "[" and cell[-1:] == "]" and any(c.isdigit() for c in cell))
        or cell.lower() in ("true", "false")
    )


def _encoding(raw: bytes) -> str:
    for mark, encoding in MARKS:
        if raw.startswith(mark):
            return encoding
    try:
        raw[: raw.rfind(b"\n") + 1].decode()
    except UnicodeDecodeError:
        return "latin-1"  # of most recorders that write a degree sign in one byte
    return "utf-8"


def _table_in(lines: Sequence[str]) -> tuple[str, int]:
    """The separator and the width of the rows, two or more cells, that hold most values.

    Lines of settings have another width, or fewer values.
    """
    best, most = (",", 0), (0.0, 0)
    for separator in SEPARATORS:
        try:
            rows = [split(line, separator) for line in lines]
        except csv.Error:
            continue
        for width in {*map(len, rows)}:
            alike = [row for row in rows if len(row) == width]
            values = sum(is_value(cell) for row in alike for cell in row)
            score = (round(len(alike) * values / (len(alike) * width or 1), 3), width)
            if score > most and (width > 1 or not best[1]):
                best, most = (separator, width), score
    return best


def _held(rows: Sequence[Sequence[str]]) -> list[int]:
    """Columns that mostly hold values."""
    columns = [[cell for cell in column if cell] for column in zip(*rows, strict=True)]
    return [j for j, cells in enumerate(columns) if sum(map(is_value, cells)) > 0.5 * len(cells)]


def _holds(row: Sequence[str], held: Sequence[int]) -> bool:
    """Whether a row has values in all columns that mostly hold values."""
    cells = [row[j] for j in held if row[j]]
    return bool(cells) and all(map(is_value, cells))


def _head(rows: Sequence[tuple[int, str]], start: int, separator: str, width: int) -> list[list[str]]:
    """The row of names above the values, if there is one, and the row of units below it, if there is one."""
    above = [(k, split(line, separator)) for k, line in rows if _is_row(line)]
    head = [(k, row) for k, row in above if len(row) == width]
    if head:
        pair = head[-2:]
        shares = [_share_of_units(row) for _, row in pair]
        beside = len(pair) == 2 and pair[0][0] == pair[1][0] - 1
        if beside and shares[1] >= 0.5 and shares[1] > shares[0]:
            return [row for _, row in pair]
        return [head[-1][1]]
    comments = [line for k, line in rows if k < start]
    cells = split(comments[-1].lstrip(" #%/"), separator) if comments else []
    return [cells] if len(cells) == width and not any(map(is_value, cells)) else []


def _share_of_units(row: Sequence[str]) -> float:
    filled = [cell for cell in row if cell]
    return sum(map(_is_unit, filled)) / max(len(filled), 1)


def _is_unit(cell: str) -> bool:
    if cell[0] in "[(" and cell[-1] in ")]":
        return True
    try:
        parse_logged(cell)
    except ValueError:
        return False
    return True


def _named(path: Path, head: Sequence[Sequence[str]], width: int) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names and units from the rows above the values: the first one names, the next one may give units."""
    found = list(head[0]) if head else [""] * width
    names: list[str] = []
    for k, cell in enumerate(found, start=1):
        name = cell.strip(" \"'\ufeff") or str(k)
        if len(name) > LONGEST:
            raise long_name(path, name)
        names.append(name if name not in names else f"{name}#{k}")
    matches = {name: match for name in names if not ELEMENT.search(name) and (match := UNIT.fullmatch(name))}
    units = {name: match["unit"] for name, match in matches.items() if match["unit"]}
    for row in head[1:2]:
        given = {name: cell.strip("[]() ") for name, cell in zip(names, row, strict=True)}
        units |= {name: unit for name, unit in given.items() if unit not in ("", "-")}
    return tuple(names), units
