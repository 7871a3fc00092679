"""Tables of results: Parquet files, or CSV files where pyarrow is not installed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.base.limits import NUMBERS, check_file


def write_table(table: pd.DataFrame, path: Path) -> None:
    """Write a table with every digit as `path`.parquet, or as `path`.csv if pyarrow is not installed."""
    try:
        from unmodelled.base.parquet import write_parquet
    except ModuleNotFoundError:
        with replacing(path.with_name(f"{path.name}.csv")) as temporary:
            table.to_csv(temporary, index=False)
        return
    with replacing(path.with_name(f"{path.name}.parquet")) as temporary:
        write_parquet(table, temporary)


def read_table(path: Path, texts: Sequence[str]) -> pd.DataFrame:
    """Read a table that `write_table` wrote."""
    plain = path.with_name(f"{path.name}.csv")
    if not plain.exists():
        from unmodelled.base.parquet import read_parquet

        return read_parquet(path.with_name(f"{path.name}.parquet"))
    check_file(plain, NUMBERS)
    try:
        return pd.read_csv(plain, dtype=dict.fromkeys(texts, str), keep_default_na=False, na_values=[""])
    except (ValueError, OSError) as error:
        raise BadInput(f"{plain}: not a table of this program ({error}): make it again") from None
