"""The container of a measurement campaign: many experiments of different length, in SI units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from unmodelled.base.arrays import Array, Indices
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.shapes import read_shaped


@dataclass(frozen=True)
class Campaign:
    """All experiments of one measurement campaign, frozen."""

    experiments: pd.DataFrame  # a row per experiment: `exp` (its id), factors and labels
    signals: Mapping[str, NDArray[Any]]  # by name, each (samples,), the experiments one after the other, SI
    offsets: Indices  # (experiments + 1,), first samples, and the number of all samples
    provenance: Mapping[str, Any]  # origin of the data; it travels with them to every page of the report

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
        """Write signals.parquet, experiments.parquet and provenance.json, all or none of them."""
        import pyarrow as pa  # an optional library

        from unmodelled.base.parquet import write_parquet

        lengths = np.diff(self.offsets)
        ids = np.repeat(self.experiments["exp"].to_numpy(), lengths)
        with replacing_folder(folder) as temporary:
            table = pa.table({"exp": pa.array(ids, pa.int32()), **dict(self.signals)})
            write_parquet(table, temporary / "signals.parquet", dictionary=["exp"])
            write_parquet(self.experiments.assign(samples=lengths), temporary / "experiments.parquet")
            write_json(temporary / "provenance.json", dict(self.provenance))

    @classmethod
    def read(cls, folder: Path, columns: list[str] | None = None) -> Campaign:
        """Read what `write` wrote."""
        from unmodelled.base.parquet import read_arrow, read_parquet  # with pyarrow, an optional library

        experiments = read_parquet(folder / "experiments.parquet")
        table = read_arrow(folder / "signals.parquet", columns)
        if missing := {"exp", "samples"} - set(experiments.columns):
            raise BadInput(f"{folder}: damaged store (experiments.parquet has no column {min(missing)})")
        samples = experiments["samples"].to_numpy()
        if samples.dtype.kind not in "iu" or (samples < 0).any():
            raise BadInput(f"{folder}: damaged store (experiments.parquet: samples must be counts)")
        offsets = np.concatenate([[0], np.cumsum(samples)]).astype(np.int64)
        if offsets[-1] != table.num_rows:
            raise BadInput(f"{folder}: signals.parquet has {table.num_rows} rows, must have {offsets[-1]}")
        signals = {name: table[name].to_numpy() for name in table.column_names if name != "exp"}
        return cls(experiments, signals, offsets, read_shaped(folder / "provenance.json", {}))
