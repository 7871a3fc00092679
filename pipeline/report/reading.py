"""Read the results of other stages; missing results are left out."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.report.checks import KINDS, check_choice, check_interval, read_object
from pipeline.report.claims import KEYS, VERDICTS, read_full
from pipeline.report.equations import read_equations
from pipeline.report.file_table import file_table
from pipeline.report.metrics import leaves
from pipeline.report.results import Diagnosis, Results
from unmodelled.base.errors import BadInput
from unmodelled.report.checks import check_chapter, read_rows
from unmodelled.report.drawn import read_figures
from unmodelled.report.headline import headline
from unmodelled.report.tables import Table

#: What the note of an execution says at least.
EXECUTION = (
    *("stage", "command", "configuration", "seed", "seconds"),
    *("finished", "revision", "machine", "versions"),
)


def read(
    metrics: Path,
    claims: Path,
    tables: Path,
    figures: Path,
    provenance: Path,
    runs: Path,
    diagnoses: Path,
    executions: Path,
    full: Path,
) -> Results:
    """Read all existing results."""
    return Results(
        _claims(claims),
        read_figures(figures) if (figures / "figures.json").exists() else [],
        [_table(path) for path in sorted(tables.glob("*.csv"))],
        {path.stem: _metrics(path) for path in sorted(metrics.glob("*.json"))},
        {
            path.parent.relative_to(provenance).as_posix(): _provenance(path)
            for depth in ("*", "*/*")
            for path in sorted(provenance.glob(f"{depth}/provenance.json"))
        },
        {
            path.parent.relative_to(runs).as_posix(): read_object(path)
            for path in sorted(runs.glob("**/fit.json"))
        },
        [read_equations(path) for path in sorted(claims.glob("*/equations.json"))],
        [
            _diagnosis(path.parents[1], diagnoses)
            for path in sorted(diagnoses.glob("**/figures/figures.json"))
        ],
        [_execution(path) for path in sorted(executions.glob("*.json"))],
        read_full(full),
    )


def _claims(folder: Path) -> list[dict[str, Any]]:
    found = []
    for path in sorted(folder.glob("*/claims.json")):
        rows = read_rows(path, KEYS)
        for row in rows:
            where = f"claim {row['id']!r}:"
            check_choice(path, f"{where} verdict", row["verdict"], tuple(VERDICTS))
            check_choice(path, f"{where} data", row["data"], KINDS)
            check_chapter(path, where, row["chapter"], needed=True)
            check_interval(path, where, row["interval"])
        found += rows
    return sorted(found, key=lambda row: row["chapter"])


def _table(path: Path) -> Table:
    sidecar = path.with_suffix(".json")
    about = read_object(sidecar) if sidecar.exists() else {}
    if not re.fullmatch(r"\w+", path.stem):
        raise BadInput(f"{path}: the name must be letters, digits and underscores")
    check_chapter(sidecar, "", about.get("chapter"))
    try:
        return file_table(path.stem, path.read_text(), about)
    except (ValueError, IndexError) as error:
        raise BadInput(f"{path}: not a table with a header and equally long rows ({error})") from None


def _metrics(path: Path) -> dict[str, Any]:
    content = read_object(path)
    check_choice(path, "data", content.get("data"), KINDS)
    check_chapter(path, "", content.get("chapter"))
    for name, leaf, _ in leaves(content, ""):
        check_interval(path, ".".join(name), leaf.get("interval"))
    return content


def _provenance(path: Path) -> dict[str, Any]:
    content = read_object(path)
    check_choice(path, "data", content.get("data"), KINDS)
    return content


def _diagnosis(folder: Path, root: Path) -> Diagnosis:
    content = read_object(folder / "diagnosis.json")
    about = read_object(folder / "tables" / "about.json")
    try:
        return Diagnosis(
            folder.relative_to(root).as_posix(), headline(content), str(about["data"] or ""), folder
        )
    except (KeyError, TypeError, IndexError) as error:
        raise BadInput(f"{folder}: not a diagnosis (lacks {error})") from None


def _execution(path: Path) -> Mapping[str, Any]:
    content = read_object(path)
    if missing := [key for key in EXECUTION if key not in content]:
        raise BadInput(f"{path}: has no {', '.join(missing)}")
    return content
