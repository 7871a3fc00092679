"""Write the results of a chapter: tables for figures, numbers, and tables for readers."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.chapters.equations import equations
from pipeline.revision import revision
from unmodelled.base.files import replacing, replacing_folder, write_json
from unmodelled.base.parquet import write_parquet
from unmodelled.systems.model import System

#: Significant digits of numbers in git: another processor, or another number of threads, changes later ones.
DIGITS = 4


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


def write_metrics(reports: Path, name: str, data: str, profile: str, numbers: Mapping[str, Any]) -> None:
    """Write metrics/<name>.json: numbers, and how they were made; no times, which are in data/executions."""
    head = {"data": data, "profile": profile, "revision": revision()}
    write_json(reports / "metrics" / f"{name}.json", {**head, **rounded(numbers)})


def rounded(content: Any) -> Any:
    """Return a nested content with `DIGITS` significant digits of every number."""
    if isinstance(content, Mapping):
        return {key: rounded(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [rounded(value) for value in content]
    return float(f"{content:.{DIGITS}g}") if isinstance(content, float) else content


def write_table(
    path: Path, table: pd.DataFrame, chapter: int | None, title: str, protocol: str, data: str = ""
) -> None:
    """Write a table as a CSV file, and its description as a JSON file."""
    with replacing(path.with_suffix(".csv")) as temporary:
        table.to_csv(temporary, index=False, float_format=f"%.{DIGITS}g")
    about = {"title": title, "caption": title, "protocol": protocol, "chapter": chapter}
    write_json(path.with_suffix(".json"), about | ({"data": data} if data else {}))
