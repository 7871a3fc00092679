"""Read published archives in their original form: a zip file or a folder, and its tables."""

import io
import os
import warnings
import zipfile
import zlib
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.limits import OBJECTS, check_file, check_memory
from unmodelled.base.search import Search
from unmodelled.logs.cells import LARGEST as LARGEST_NUMBER


class Archive:
    """The published files of a machine, in a zip file or folder, with or without folders around the files.

    `variable` is the environment variable that can give the path; `members` are the paths inside, sorted.
    """

    def __init__(self, path: str | None, variable: str) -> None:
        if not path:
            raise BadInput(
                f"source.archive: must be given: source.archive=<zip file or folder>, or {variable}=<...>"
            )
        self.path = Path(str(path)).expanduser()
        self._zip: zipfile.ZipFile | None = None
        check_file(self.path, 0.0)  # of any size: its members are read one at a time
        if self.path.is_dir():
            search = Search(lambda why: BadInput(f"{self.path}: {why}: give the folder of the archive"))
            files = (p for p in search.below(self.path) if not os.path.isdir(p))  # noqa: PTH112 - some refuse it
            self.members = sorted(p.relative_to(self.path).as_posix() for p in files)
        elif self.path.is_file():
            try:
                self._zip = zipfile.ZipFile(self.path)
            except (zipfile.BadZipFile, OSError) as error:
                raise BadInput(f"{self.path}: is not a zip file, nor a folder ({error})") from None
            self.members = sorted(n for n in self._zip.namelist() if not n.endswith("/"))
        else:
            raise BadInput(f"{self.path}: no such file or folder")

    def names(self, pattern: str) -> list[str]:
        """Return the members whose path ends with `pattern`, sorted."""
        found = [n for n in self.members if fnmatchcase(n, pattern) or fnmatchcase(n, f"*/{pattern}")]
        if not found:
            raise BadInput(f"{self.path}: holds no {pattern}")
        return found

    def where(self, name: str) -> str:
        """Return the name of a member for error messages."""
        return f"{self.path}: {name}"

    def read(self, name: str, factor: float = OBJECTS) -> bytes:
        """Return the content of a member."""
        if name not in self.members:
            raise BadInput(f"{self.path}: holds no {name}")
        try:
            if self._zip is None:
                check_file(self.path / name, factor)
                return (self.path / name).read_bytes()
            check_memory(self.where(name), factor * self.size(name))
            with self._zip.open(name) as member:  # without a limit, all of it is unpacked, and then cut
                return member.read(self.size(name) + 1)
        except (zipfile.BadZipFile, OSError, EOFError, zlib.error, RuntimeError, ValueError) as error:
            raise BadInput(f"{self.where(name)}: cannot be read ({error})") from None

    def size(self, name: str) -> int:
        """Return the size of a member after unpacking, bytes."""
        return (self.path / name).stat().st_size if self._zip is None else self._zip.getinfo(name).file_size

    def cells(self, name: str, columns: Sequence[str], names: Sequence[str] | None = None) -> pd.DataFrame:
        """Return columns of a CSV member as text."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", pd.errors.ParserWarning)  # cells that would be left out
                table = pd.read_csv(
                    io.BytesIO(self.read(name)),
                    dtype=str,
                    keep_default_na=False,
                    skipinitialspace=True,
                    index_col=False,
                    header=0 if names is None else None,
                    names=None if names is None else list(names),
                )
        except (ValueError, pd.errors.ParserError, pd.errors.ParserWarning) as error:
            raise BadInput(f"{self.where(name)}: not a table ({' '.join(str(error).split())})") from None
        for column in columns:
            if column not in table:
                raise BadInput(f"{self.where(name)}: row 1: column {column} is missing")
        if table.empty:
            raise BadInput(f"{self.where(name)}: row 1: no rows below it")
        return table[list(columns)]

    def table(self, name: str, columns: Sequence[str], names: Sequence[str] | None = None) -> pd.DataFrame:
        """Return columns of a CSV member as numbers."""
        cells = self.cells(name, columns, names)
        first = 2 if names is None else 1
        return pd.DataFrame({c: numbers(cells[c], f"{self.where(name)}", c, first) for c in columns})


def numbers(cells: pd.Series, where: str, column: str, first: int) -> Array:
    """Convert cells to numbers; gives (n,)."""
    values = np.asarray(pd.to_numeric(cells, errors="coerce"), np.float64)
    bad = np.flatnonzero(~(np.abs(values) < LARGEST_NUMBER))
    if len(bad):
        cell = str(cells.iloc[bad[0]])[:30]
        raise BadInput(f"{where}: row {bad[0] + first}: column {column}: {cell!r} is not a finite number")
    return values


def measured(value: object) -> float | None:
    """Convert a value of a JSON file to a number (true is 1)."""
    if not isinstance(value, int | float) or not abs(value) < LARGEST_NUMBER:
        return None
    return float(value)
