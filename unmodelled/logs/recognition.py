"""The format of a file by its first bytes, and of a file that should be a table the way to convert it."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from unmodelled.base.errors import BadInput, Faults, first_few, nearest
from unmodelled.base.limits import check_file

NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
#: How an HDF5 file begins, and where: MATLAB writes 512 bytes of its own first.
HDF5, HDF5_STARTS = b"\x89HDF\r\n\x1a\n", (0, 512)
#: How a Parquet file begins.
PARQUET = b"PAR1"
#: A binary log that begins with lines of text.
BLACKBOX = b"H Product:Blackbox"
#: First bytes of files that loggers and offices write, what they are, and what to do with them.
FORMATS = (
    (b"\x1f\x8b", "a gzip file", "unpack it with gunzip"),
    (b"BZh", "a bzip2 file", "unpack it with bunzip2"),
    (b"\xfd7zXZ", "an xz file", "unpack it with unxz"),
    (b"\x28\xb5\x2f\xfd", "a zstd file", "unpack it with unzstd"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it"),
    (b"MATLAB ", "a MAT file", "save it as CSV, in MATLAB with writetable"),
    (b"\x89HDF", "an HDF5 file", "give it as logs=<file>"),
    (b"MDF     ", "an MDF file", "save it as CSV"),
    (b"TDSm", "a TDMS file", "save it as CSV"),
    (b"\x93NUMPY", "a NumPy file", "save it as CSV or Parquet"),
    (b"ARROW1", "a Feather file", "save it as CSV or Parquet"),
    (b"\xd0\xcf\x11\xe0", "an Excel file", "save it as CSV"),
    (b"\xff\xfe", "UTF-16 text", "save it as UTF-8"),
    (b"\xfe\xff", "UTF-16 text", "save it as UTF-8"),
    (PARQUET, "a Parquet file", "save it as CSV"),
    (b"\xa3\x95\x80\x80", "a binary log of ArduPilot", "convert it to a text log (.log)"),
    (BLACKBOX, "a binary log of Blackbox", "export it as CSV, with blackbox_decode or the viewer"),
)
#: What the beginning of a zip archive contains whose first bytes do not tell what it is.
ZIPS = (
    (b"[Content_Types].xml", "an Excel file", "save it as CSV"),
    (b"opendocument.spreadsheet", "an OpenDocument spreadsheet", "save it as CSV"),
    (b"", "a zip archive", "unpack it"),
)
#: Bytes by which a format is known.
FIRST = 4096
#: Bytes and rows in which a header is looked for, and names of it that a message shows.
START, ROWS, NAMES = 2**16, 30, 12
SEPARATORS = {";": "';'", "\t": "tabs", "|": "'|'", " ": "spaces"}
#: How a row begins that most programs take for a comment.
COMMENT = ("#", "%", "//")


@dataclass(frozen=True)
class Source:
    """A file that may be read, with its first bytes."""

    path: Path
    start: bytes

    @classmethod
    def of(cls, path: Path, factor: float = 1.0) -> Source:
        """Look at a file; refuse one that cannot be read, or whose size times a factor exceeds the memory."""
        check_file(path, factor)
        try:
            with path.open("rb") as file:
                return cls(path, file.read(FIRST))
        except (OSError, ValueError) as error:
            raise BadInput(f"{path}: {reason(error)}") from None

    @property
    def is_hdf5(self) -> bool:
        """Return whether it begins as an HDF5 file does."""
        return any(self.start.startswith(HDF5, at) for at in HDF5_STARTS)

    @property
    def is_parquet(self) -> bool:
        """Return whether it begins as a Parquet file does."""
        return self.start.startswith(PARQUET)

    def foreign(self, wanted: str) -> BadInput | None:
        """Return the error that it is another file, and what to do; None for what may be a CSV file."""
        kinds: Sequence[tuple[bytes, str, str]] = FORMATS
        if self.start.startswith(b"PK\x03\x04"):
            kinds = tuple((b"", name, advice) for inside, name, advice in ZIPS if inside in self.start)
        for first, name, advice in kinds:
            if self.start.startswith(first):
                return BadInput(f"{self.path}: is {name}, not {wanted}: {advice}")
        return None


def reason(error: Exception) -> str:
    """Return why a file cannot be read as a table."""
    if isinstance(error, FileNotFoundError):
        return "no such file"
    if isinstance(error, OSError):
        return f"cannot be read ({error.strerror})"
    return f"not a table ({' '.join(str(error).split())})"


def refuse_header(path: Path, header: Sequence[str], wanted: Sequence[str]) -> None:
    """Refuse a header that lacks some columns, saying what it has instead."""
    rows, separator = _start(path), _separator(header, wanted)
    place = f"{path}: row 1"
    faults = Faults()
    for number, row in enumerate(rows[1:], start=2):
        apart = _separator(row.split(","), wanted)
        if set(wanted) <= set(_cells(row, apart)):
            above = "row 1" if number == 2 else f"rows 1 to {number - 1}"
            found = f"must name the columns; row {number} does: delete {above}"
            raise BadInput(f"{place}: {found}{_commas(apart, rows[number:])}")
    if all(NUMBER.fullmatch(cell) for cell in header if cell):
        numbers = "; it holds numbers: write the names above it" if any(header) else ""
        raise BadInput(f"{place}: must name the columns, {_listed(wanted)}{numbers}")
    if separator != ",":
        found = f"the columns are separated by {SEPARATORS[separator]}"
        faults.add(f"{place}: {found}{_commas(separator, rows[1:])}")
    cells = _cells(",".join(header), separator)
    with faults.collected():
        refuse_missing(place, "the header", cells, wanted)
    faults.check()


def refuse_missing(place: str, holder: str, names: Sequence[str], wanted: Sequence[str]) -> None:
    """Refuse a table that lacks some columns, saying which name it may have instead."""
    faults = Faults()
    spare = {_plain(name): name for name in names if name and name not in wanted}
    for name in (name for name in wanted if name not in names):
        near = _near(name, spare)
        found = f"there is {spare[near]!r}: rename it" if near else f"{holder} has {_listed(names)}"
        faults.add(f"{place}: column {name} is missing; {found}")
    faults.check()


def odd_row(cells: Sequence[str]) -> str:
    """Return the end of a message about a row that has not as many cells as the header."""
    if cells[0].startswith(COMMENT):
        return "; it is a comment: delete it"
    if all(NUMBER.fullmatch(cell) for cell in cells):
        return "; if these are decimal commas, write decimal points"
    return ""


def not_utf8(path: Path) -> str:
    """Return the end of a message about a file that is not UTF-8 text: the row where it stops being so."""
    with path.open("rb") as file:
        for row, line in enumerate(file, start=1):
            try:
                line.decode()
            except UnicodeDecodeError as error:
                return f"row {row}: byte 0x{line[error.start]:02x} is not UTF-8 text: save the file as UTF-8"
    return "not UTF-8 text: save the file as UTF-8"


def _start(path: Path) -> list[str]:
    with path.open("rb") as file:
        return file.read(START).decode("utf-8-sig", "replace").splitlines()[:ROWS]


def _separator(header: Sequence[str], wanted: Sequence[str]) -> str:
    """Return the separator of the columns of a header that was cut at commas."""
    row = ",".join(header)
    best, most = ",", sum(name in header for name in wanted)
    for separator in SEPARATORS:
        found = sum(name in _cells(row, separator) for name in wanted)
        if found > most or (len(header) == 1 and best == "," and separator in row):
            best, most = separator, found
    return best


def _cells(row: str, separator: str) -> list[str]:
    return [cell.strip().strip("\"'") for cell in row.split(separator)]


def _commas(separator: str, rows: Sequence[str]) -> str:
    """Return advice on how to save a table with another separator."""
    if separator == ",":
        return ""
    decimal = any(re.search(r"\d,\d", cell) for cell in _cells(rows[0] if rows else "", separator))
    return "; save the file with commas between columns" + (" and decimal points" if decimal else "")


def _near(name: str, known: Collection[str]) -> str | None:
    """The one of `known` that `name` probably is: spelt nearly like it, or the only one that it begins."""
    longer = [k for k in known if k.lower().startswith(name.lower())]
    return nearest(name, known) or (longer[0] if len(longer) == 1 else None)


def _plain(cell: str) -> str:
    """A name without its unit in brackets and without what makes a comment of it."""
    return re.sub(r"[\[(].*", "", cell).strip(" \t#%\"'")


def _listed(names: Sequence[str]) -> str:
    return first_few([repr(name[:30]) for name in names], NAMES)
