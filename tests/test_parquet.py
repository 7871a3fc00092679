"""Tables that tell when they are damaged."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from unmodelled.base.errors import BadInput
from unmodelled.base.parquet import read_arrow, read_parquet, write_parquet

TABLE = pd.DataFrame(
    {"id": ["a", "b"] * 500, "x": np.random.default_rng(0).normal(size=1000)}, index=range(1000)
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_parquet(TABLE, tmp_path / "table.parquet")
    return tmp_path / "table.parquet"


def test_what_is_written_is_read_back(path: Path) -> None:
    pd.testing.assert_frame_equal(read_parquet(path), TABLE.reset_index(drop=True))
    assert read_arrow(path, ["x"]).column_names == ["x"]


def test_every_bit_of_the_numbers_is_guarded(path: Path) -> None:
    content = path.read_bytes()
    column = pq.ParquetFile(path).metadata.row_group(0).column(1)
    first = column.dictionary_page_offset or column.data_page_offset
    for at in range(first + 60, first + column.total_compressed_size, 97):
        path.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
        with pytest.raises(BadInput, match=r"table\.parquet: not a Parquet file, or damaged"):
            read_parquet(path)


def test_what_is_no_table_is_named(path: Path) -> None:
    with pytest.raises(BadInput, match=r"table\.parquet: has no column y"):
        read_parquet(path, ["x", "y"])
    path.write_bytes(b"")
    with pytest.raises(BadInput, match=r"table\.parquet: not a Parquet file"):
        read_parquet(path)
    with pytest.raises(BadInput, match=r"none\.parquet: no such file"):
        read_parquet(path.with_name("none.parquet"))


def test_a_column_has_its_own_name_whatever_pandas_notes_beside_it(path: Path) -> None:
    table = pq.read_table(path)
    noted = {key: text.replace(b'"x"', b'"!"', 1) for key, text in table.schema.metadata.items()}
    assert noted != table.schema.metadata
    pq.write_table(table.replace_schema_metadata(noted), path)
    pd.testing.assert_frame_equal(read_parquet(path, ["x"]), TABLE[["x"]].reset_index(drop=True))


def test_an_index_of_pandas_is_a_column(path: Path) -> None:
    """As tables are often saved: the time is the index."""
    TABLE.set_index("x").to_parquet(path)
    pd.testing.assert_frame_equal(read_parquet(path, ["id", "x"]), TABLE.reset_index(drop=True))
