"""Write tables for readers: CSV files, with a description for a page."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from unmodelled.base.files import read_json, replacing, write_json


def training_seconds(fits: Path) -> float:
    """Return the duration of all fits, s."""
    return sum(float(read_json(p)["seconds"]) for p in sorted(fits.glob("[!.]*/[!.]*/fit.json")))


def write_table(
    path: Path, table: pd.DataFrame, chapter: int | None, title: str, protocol: str, data: str = ""
) -> None:
    """Write a table as a CSV file, and its description as a JSON file."""
    with replacing(path.with_suffix(".csv")) as temporary:
        table.to_csv(temporary, index=False, float_format="%.6g")
    about = {"title": title, "caption": title, "protocol": protocol, "chapter": chapter}
    write_json(path.with_suffix(".json"), about | ({"data": data} if data else {}))
