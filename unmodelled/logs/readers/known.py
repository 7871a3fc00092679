"""All readers, and the one that reads a file."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from dataclasses import replace
from functools import cache
from pathlib import Path

from unmodelled.base.additions import additions
from unmodelled.base.errors import BadInput, Faults, first_line
from unmodelled.base.limits import check_file, limited_process
from unmodelled.base.search import Search
from unmodelled.base.workers import pool_of
from unmodelled.logs.readers.dataflash import DataFlash
from unmodelled.logs.readers.delimited import Delimited
from unmodelled.logs.readers.hdf5 import Hdf5
from unmodelled.logs.readers.json_records import JsonRecords
from unmodelled.logs.readers.long import by_thing
from unmodelled.logs.readers.mat import Mat
from unmodelled.logs.readers.mcap import Mcap
from unmodelled.logs.readers.mdf import Mdf
from unmodelled.logs.readers.messages import Messages
from unmodelled.logs.readers.npz import Npz
from unmodelled.logs.readers.parquet import Parquet
from unmodelled.logs.readers.reader import LONGEST, START, Reader, Table, long_name
from unmodelled.logs.readers.rosbag import RosBag
from unmodelled.logs.readers.tdms import Tdms
from unmodelled.logs.readers.ulog import ULog
from unmodelled.logs.readers.wpilog import WpiLog
from unmodelled.logs.recognition import Source

#: Readers in the order in which they are asked; what is left is text.
_RECORDERS = (Mdf, Mcap, RosBag, ULog, DataFlash, Tdms, WpiLog)
_FORMATS = (Parquet, Hdf5, Mat, Npz, *_RECORDERS, JsonRecords, Messages, Delimited)
READERS: tuple[Reader, ...] = tuple(kind() for kind in _FORMATS)
#: Group of entry points by which other packages add readers; each names an object, not a class.
GROUP = "unmodelled.readers"
#: Processor time that reading a file may take: seconds for any of them, and bytes per further second.
SECONDS, RATE = 60.0, 2e5


@cache
def readers() -> tuple[Reader, ...]:
    """Return all readers: those of other packages first, so that they may replace one."""
    return (*(reader for _, reader in additions(GROUP, "reader", "recognises")), *READERS)


def reader_of(path: Path) -> Reader | None:
    """Return the reader of a file; None for a folder of files that belong together."""
    check_file(path)
    try:
        with path.open("rb") as file:
            start = file.read(START)
    except IsADirectoryError:
        start = b""
    except (OSError, ValueError) as error:
        raise BadInput(f"{path}: cannot be read ({getattr(error, 'strerror', error)})") from None
    for reader in readers():
        if reader.recognises(path, start):
            return reader
    if path.is_dir():
        return None
    wanted = f"of a format that is read ({', '.join(reader.name for reader in readers())})"
    unknown = BadInput(f"{path}: is not {wanted}: leave it out, or save it as CSV")
    raise Source(path, start).foreign(wanted) or unknown


def read_files(
    paths: Sequence[Path], wanted: Sequence[str] | None, faults: Faults
) -> dict[Path, list[Table]]:
    """Read the tables of files, one after the other."""
    found: dict[Path, list[Table]] = {}
    with ExitStack() as stack:
        pool: ProcessPoolExecutor | None = None
        for path in paths:
            with faults.collected():
                reader = reader_of(path)
                if reader is None:
                    found[path] = _together(path, wanted)
                    continue
                for file in _files(path):
                    check_file(file)  # a pipe in a bag would be waited for
                if not reader.isolated:
                    found[path] = _read(reader, path, wanted)
                    continue
                pool = pool or stack.enter_context(pool_of(1))
                try:
                    found[path] = pool.submit(_limited, reader, path, wanted).result()
                except BrokenProcessPool:
                    pool = None
                    how = "crashes on it, or does not end"
                    raise BadInput(f"{path}: damaged: the library for {reader.name} {how}") from None
    return found


def _together(folder: Path, wanted: Sequence[str] | None) -> list[Table]:
    """Read the files in a folder as the tables of one recording; a table has the name of its file."""
    files = [path for path in sorted(folder.iterdir()) if path.is_file() and not path.name.startswith(".")]
    named = [path for path in files if any(name.startswith(f"{path.stem}.") for name in wanted or ())]
    faults = Faults()
    read = read_files(named or files, None, faults)
    if named or not read:
        faults.check()
    # a file that no column names may be anything: a list of names, a note
    read |= read_files([path for path in files if path not in read], None, Faults())
    found = [
        replace(table, name=f"{path.stem}.{table.name}" if table.name else path.stem)
        for path, tables in read.items()
        for table in tables
    ]
    if not found:
        raise BadInput(f"{folder}: holds no files: leave it out")
    zeros: dict[str, int] = {}
    for name, zero in (pair for table in found for pair in table.origins.items()):
        zeros[name] = min(zero, zeros.get(name, zero))
    return [_since(table, zeros) for table in found]


def _since(table: Table, zeros: Mapping[str, int]) -> Table:
    """The table with its dates in s since the instants, in ns since 1970, that all tables share."""
    later = {name: 1e-9 * (own - zeros[name]) for name, own in table.origins.items()}
    columns = {name: values + later.get(name, 0.0) for name, values in table.columns.items()}
    return replace(table, columns=columns, origins={name: zeros[name] for name in table.origins})


def _read(reader: Reader, path: Path, wanted: Sequence[str] | None) -> list[Table]:
    """Read a file; refuse what the reader cannot read."""
    try:
        tables = [part for table in reader.read(path, wanted) for part in by_thing(table)]
    except BadInput:
        raise
    except ModuleNotFoundError as error:
        raise BadInput(
            f"{path}: is in format {reader.name}; {error.name} is not installed: pip install {reader.install}"
        ) from None
    except MemoryError:
        raise BadInput(f"{path}: is too large for the memory that is left: record less in a file") from None
    except Exception as error:  # there is no common base of what a damaged file can raise
        reason = first_line(error)
        raise BadInput(f"{path}: not in format {reader.name}, or damaged ({reason[:100]})") from None
    for name in (name for table in tables for name in (*table.columns, *table.texts, *table.aliases)):
        if len(name) > LONGEST:
            raise long_name(path, name)
    if not any(len(table) for table in tables):
        raise BadInput(f"{path}: holds no columns of numbers: leave it out")
    return tables


def _limited(reader: Reader, path: Path, wanted: Sequence[str] | None) -> list[Table]:
    """Read a file in the process for it, within the limits of that process."""
    _silence()
    with limited_process(SECONDS + sum(file.stat().st_size for file in _files(path)) / RATE):
        return _read(reader, path, wanted)


def _files(path: Path) -> list[Path]:
    """The file, or the files below a folder without links that lead nowhere."""
    if not path.is_dir():
        return [path]
    search = Search(lambda why: BadInput(f"{path}: {why}: give the folder of the recording"))
    return [file for file in search.below(path) if file.exists()]


@cache  # once in a process
def _silence() -> None:
    """Let libraries print nothing: what is wrong with a file is told in one line."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nothing, stream)
