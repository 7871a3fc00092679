"""Parquet files with a checksum on every page, so that damage is detected."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from unmodelled.base.errors import BadInput, closest, first_line
from unmodelled.base.limits import check_file, check_memory

#: Bytes of a cell in memory: a number, or the place of a text; and of an element of a list, whose copies are
#: the Arrow array, the same in one piece, without the lists, and in columns.
_CELL, _ELEMENT = 8, 50
#: Copies of the characters of texts, at most: the unpacked page, the Arrow array twice, texts of Python.
_COPIES = 5
_TEXTS = (pa.string(), pa.large_string(), pa.binary(), pa.large_binary())


def write_parquet(
    table: pd.DataFrame | pa.Table, path: Path, dictionary: bool | Sequence[str] = True
) -> None:
    """Write a table as a compressed Parquet file with checksums."""
    if isinstance(table, pd.DataFrame):
        table = pa.Table.from_pandas(table, preserve_index=False)
    pq.write_table(table, path, compression="zstd", use_dictionary=dictionary, write_page_checksum=True)


def read_schema(path: Path) -> pa.Schema:
    """Read the names and types of the columns of a Parquet file."""
    try:
        return pq.read_schema(path)
    except (pa.ArrowException, OSError) as error:
        raise BadInput(f"{path}: not a table ({str(error).splitlines()[0]})") from None


def read_arrow(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Read a Parquet file as an Arrow table."""
    check_file(path)
    wanted = None if columns is None else list(columns)
    try:
        about = pq.read_metadata(path)
        schema = about.schema.to_arrow_schema()
        if lacking := [name for name in wanted or () if name not in schema.names]:
            raise BadInput(f"{path}: has no column {lacking[0]}{closest(lacking[0], schema.names)}")
        check_memory(f"{path} ({about.num_rows} rows)", _size(about, wanted))
        texts = [f.name for f in schema if f.type in _TEXTS and schema.names.count(f.name) == 1]
        # a text that recurs is read once, so that its length is known before there are copies of it
        table = pq.read_table(path, columns=wanted, page_checksum_verification=True, read_dictionary=texts)
        return _with_texts(path, table, schema)
    except FileNotFoundError:
        raise BadInput(f"{path}: no such file: check the path") from None
    except MemoryError:
        raise BadInput(
            f"{path}: is too large for the memory that is left: give fewer rows or columns"
        ) from None
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = first_line(error)
        raise BadInput(f"{path}: not a Parquet file, or damaged ({reason[:100]}): make it again") from None


def _size(about: pq.FileMetaData, wanted: Sequence[str] | None) -> int:
    """Return the memory of the wanted columns in bytes; a text counts as often as the file has it."""
    leaves = [about.schema.column(k) for k in range(about.num_columns)]
    size = 0
    for k, leaf in enumerate(leaves):
        if wanted is None or any(leaf.path == name or leaf.path.startswith(f"{name}.") for name in wanted):
            chunks = [about.row_group(g).column(k) for g in range(about.num_row_groups)]
            cells = sum(chunk.num_values for chunk in chunks)
            size += cells * max(_ELEMENT if leaf.max_repetition_level else _CELL, leaf.length)
            if leaf.physical_type == "BYTE_ARRAY":
                size += _COPIES * sum(chunk.total_uncompressed_size for chunk in chunks)
    return size


def _with_texts(path: Path, table: pa.Table, schema: pa.Schema) -> pa.Table:
    """Return the table with dictionary-encoded texts converted back to the types of `schema`."""
    for k, field in enumerate(table.schema):
        kind = schema.field(field.name).type if schema.names.count(field.name) == 1 else field.type
        if kind == field.type or kind not in _TEXTS:
            continue
        chunks = table.column(k).chunks
        lengths = (pc.binary_length(c.dictionary).cast(pa.int64()).take(c.indices) for c in chunks)
        check_memory(f"{path}: column {field.name}", sum(pc.sum(each).as_py() or 0 for each in lengths))
        table = table.set_column(k, field.with_type(kind), table.column(k).cast(kind))
    return table


def read_parquet(path: Path, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Read a Parquet file as a DataFrame."""
    table = read_arrow(path, columns)
    try:
        # pandas notes in the file which column is an index and which has another name: all are columns here
        return table.to_pandas(ignore_metadata=True)
    except (pa.ArrowException, ValueError, TypeError, KeyError) as error:
        reason = first_line(error)
        raise BadInput(f"{path}: not a table of this program ({reason[:100]}): make it again") from None
