"""What a reader of a recorder's files gives: tables of columns, each with the clock of its format."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.logs.cells import shown

#: Bytes at the beginning of a file by which a reader recognises it.
START = 4096
#: Most characters of the name of a column.
LONGEST = 1000


def long_name(path: Path, name: str) -> BadInput:
    """Return the error that the name of a column is too long."""
    return BadInput(
        f"{path}: column {shown(name)}: its name has {len(name)} characters, more than {LONGEST}: rename it"
    )


@dataclass(frozen=True)
class Table:
    """Columns of equal length in one file: a topic, a group of channels, a struct, or the file itself.

    Two tables of a file may have the same name, if the columns of one place differ in length.
    """

    name: str  # in its file; "": what lies at the top of the file
    columns: Mapping[str, Array]  # (rows,) by name, nan where there is none
    units: Mapping[str, str] = field(default_factory=dict)  # as the file writes it, by column
    texts: Mapping[str, Sequence[str]] = field(default_factory=dict)  # (rows,) by column
    aliases: Mapping[str, str] = field(default_factory=dict)  # column by another name that the file gives it
    clock: Array | None = None  # of the format, (rows,), s; None: time is a column like any other
    first: int = 1  # number of the first row in the file, as an editor counts
    rows: Indices | None = None  # (rows,), numbers in the file; None: they follow each other
    #: Zeros of columns of dates, which are in s since the first one, ns since 1970.
    origins: Mapping[str, int] = field(default_factory=dict)
    #: Words in a column of numbers, such as "unavailable", by row, by column.
    words: Mapping[str, Mapping[int, str]] = field(default_factory=dict)

    def __len__(self) -> int:
        return next((len(column) for column in (*self.columns.values(), *self.texts.values())), 0)

    def numbered(self, rows: Indices) -> Indices:
        """Return the numbers of rows (rows,) in the file, as an editor counts."""
        return rows + self.first if self.rows is None else self.rows[rows]

    def among(self, name: str, rows: Indices) -> Table:
        """Return some rows (rows,) as a table of another name."""
        chosen = rows.tolist()
        return replace(
            self,
            name=name,
            columns={key: values[rows] for key, values in self.columns.items()},
            texts={key: [cells[row] for row in chosen] for key, cells in self.texts.items()},
            clock=None if self.clock is None else self.clock[rows],
            rows=self.numbered(rows),
            words={key: among_rows(words, rows) for key, words in self.words.items()},
        )

    def address(self, column: str) -> str:
        """Return the name by which a mapping finds a column of this table, such as `/joints.position[0]`."""
        return f"{self.name}.{column}" if self.name else column


def among_rows(words: Mapping[int, str], rows: Indices) -> dict[int, str]:
    """Return words of some rows (rows,), by their places among these."""
    return {k: words[row] for k, row in enumerate(rows.tolist()) if row in words}


class Reader(Protocol):
    """Reader of one format.

    A reader has no state, and it may be sent to another process. Libraries beyond those of the package are
    imported in `read` alone.
    """

    @property
    def name(self) -> str:
        """Name of the format, for messages: "MDF"."""

    @property
    def install(self) -> str:
        """Packages that `pip install` gets if a library is missing; "" where none can be."""

    @property
    def isolated(self) -> bool:
        """Whether a damaged file can crash the library: then a process with limits of its own reads it."""

    def recognises(self, path: Path, start: bytes) -> bool:
        """Return whether a file is of this format, without a library.

        Args:
            path: path of the file, or of a folder.
            start: first `START` bytes of the file; b"" for a folder.
        """

    def read(self, path: Path, wanted: Sequence[str] | None) -> list[Table]:
        """Read the tables of a file.

        Args:
            path: path of a file that `recognises` accepts.
            wanted: names of the columns that are used, as a mapping writes them: a reader may leave other
                tables out; None: all columns.

        Returns:
            Tables with at least one column.

        Raises:
            BadInput: when the file cannot be used, naming it. Any other exception is taken for damage.
        """
