"""The container of a measurement campaign: many experiments of different length, in SI units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from pipeline.errors import BadInput
from pipeline.files import read_json, replacing_folder, write_json

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Campaign:
    """All experiments of one campaign, immutable.

    Attributes:
        experiments: (n rows) one row per experiment: `exp` (its id), factors and labels.
        signals: name -> (total samples,) the experiments' samples one after the other.
        offsets: (n + 1,) experiment `i` owns the samples `offsets[i]:offsets[i + 1]`.
        provenance: where the data come from; travels with the data to every page of the report.
    """

    experiments: pd.DataFrame
    signals: Mapping[str, NDArray[Any]]
    offsets: NDArray[np.int64]
    provenance: Mapping[str, Any]

    def __post_init__(self) -> None:
        total = int(self.offsets[-1])
        if len(self.offsets) != len(self.experiments) + 1:
            raise ValueError(
                f"offsets must have {len(self.experiments) + 1} entries, got {len(self.offsets)}"
            )
        for name, values in self.signals.items():
            if values.shape != (total,):
                raise ValueError(f"signal {name} must have shape ({total},), got {values.shape}")

    def __len__(self) -> int:
        return len(self.experiments)

    def __getitem__(self, i: int) -> dict[str, Array]:
        """Signals of the experiment in row `i`, float64."""
        a, b = self.offsets[i], self.offsets[i + 1]
        return {name: np.asarray(values[a:b], np.float64) for name, values in self.signals.items()}

    def __iter__(self) -> Iterator[dict[str, Array]]:
        return (self[i] for i in range(len(self)))

    def write(self, folder: Path) -> None:
        """Write `folder` with signals.parquet, experiments.parquet and provenance.json, atomically."""
        lengths = np.diff(self.offsets)
        ids = np.repeat(self.experiments["exp"].to_numpy(), lengths)
        with replacing_folder(folder) as temporary:
            table = pa.table({"exp": pa.array(ids, pa.int32()), **dict(self.signals)})
            pq.write_table(table, temporary / "signals.parquet", compression="zstd", use_dictionary=["exp"])
            self.experiments.assign(samples=lengths).to_parquet(
                temporary / "experiments.parquet", index=False
            )
            write_json(temporary / "provenance.json", dict(self.provenance))

    @classmethod
    def read(cls, folder: Path, columns: list[str] | None = None) -> Campaign:
        """Read what `write` wrote; `columns` limits the signals.

        Raises:
            BadInput: when a file is missing, damaged or the two tables disagree.
        """
        try:
            experiments = pd.read_parquet(folder / "experiments.parquet")
            table = pq.read_table(folder / "signals.parquet", columns=columns)
        except FileNotFoundError as error:
            raise BadInput(f"{error.filename or folder}: no such file") from None
        except (pa.ArrowInvalid, OSError) as error:
            raise BadInput(f"{folder}: damaged store ({str(error).splitlines()[0]})") from None
        if missing := {"exp", "samples"} - set(experiments.columns):
            raise BadInput(f"{folder}: damaged store (experiments.parquet has no column {min(missing)})")
        offsets = np.concatenate([[0], np.cumsum(experiments["samples"].to_numpy())]).astype(np.int64)
        if offsets[-1] != table.num_rows:
            raise BadInput(f"{folder}: signals.parquet has {table.num_rows} rows, must have {offsets[-1]}")
        signals = {name: table[name].to_numpy() for name in table.column_names if name != "exp"}
        return cls(experiments, signals, offsets, read_json(folder / "provenance.json"))
