"""Write the results of a chapter: tables for figures, numbers, and tables for readers."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.chapters.equations import equations
from pipeline.revision import revision
from unmodelled.base.files import read_json, replacing, replacing_folder, write_json
from unmodelled.base.parquet import write_parquet
from unmodelled.systems.model import System


def training_seconds(fits: Path) -> float:
    """Return the duration of all fits, s."""
    return sum(float(read_json(p)["seconds"]) for p in sorted(fits.glob("[!.]*/[!.]*/fit.json")))


def write_chapter(out: Path, tables: Mapping[str, pd.DataFrame], **files: Any) -> None:
    """Replace a folder by tables as Parquet files, and contents of JSON files, by name."""
    with replacing_folder(out) as folder:
        for name, table in tables.items():
            write_parquet(table, folder / f"{name}.parquet")
        for name, content in files.items():
            write_json(folder / f"{name}.json", content)


def equations_of(chapter: int, system: System) -> dict[str, Any]:
    """Return the content of equations.json."""
    return {"chapter": chapter, "rows": [asdict(equation) for equation in equations(system)]}


def write_metrics(
    reports: Path, name: str, data: str, profile: str, seconds: float, numbers: Mapping[str, Any]
) -> None:
    """Write metrics/<name>.json: numbers, and how they were made."""
    head = {"data": data, "profile": profile, "revision": revision(), "seconds": seconds}
    write_json(reports / "metrics" / f"{name}.json", {**head, **numbers})


def write_table(
    path: Path, table: pd.DataFrame, chapter: int | None, title: str, protocol: str, data: str = ""
) -> None:
    """Write a table as a CSV file, and its description as a JSON file."""
    with replacing(path.with_suffix(".csv")) as temporary:
        table.to_csv(temporary, index=False, float_format="%.6g")
    about = {"title": title, "caption": title, "protocol": protocol, "chapter": chapter}
    write_json(path.with_suffix(".json"), about | ({"data": data} if data else {}))
