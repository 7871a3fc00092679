"""Tables as Parquet files that tell when they are damaged: every page has a check sum."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.errors import BadInput

#: Cells of a table that is read. A file of some kB can ask for any number of equal ones.
LARGEST = 2_000_000_000


def write_parquet(
    table: pd.DataFrame | pa.Table, path: Path, dictionary: bool | Sequence[str] = True
) -> None:
    """Write a table, without the index of a DataFrame; `dictionary`: columns in which few values recur."""
    if isinstance(table, pd.DataFrame):
        table = pa.Table.from_pandas(table, preserve_index=False)
    pq.write_table(table, path, compression="zstd", use_dictionary=dictionary, write_page_checksum=True)


def read_arrow(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """A table, or some of its columns.

    Raises:
        BadInput: when the file is missing, damaged or no Parquet file, is too large, or lacks a column.
    """
    wanted = None if columns is None else list(columns)
    try:
        about = pq.read_metadata(path)
        if about.num_rows * about.num_columns > LARGEST:
            raise BadInput(f"{path}: is too large: {about.num_rows} rows, {about.num_columns} columns")
        if lacking := [name for name in wanted or () if name not in about.schema.to_arrow_schema().names]:
            raise BadInput(f"{path}: has no column {lacking[0]}")
        return pq.read_table(path, columns=wanted, page_checksum_verification=True)
    except FileNotFoundError:
        raise BadInput(f"{path}: no such file") from None
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise BadInput(f"{path}: not a Parquet file, or damaged ({reason[:100]})") from None


def read_parquet(path: Path, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Like `read_arrow`, as a DataFrame."""
    table = read_arrow(path, columns)
    try:
        return table.to_pandas()
    except (pa.ArrowException, ValueError, TypeError, KeyError) as error:
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise BadInput(f"{path}: not a table of this program ({reason[:100]})") from None
