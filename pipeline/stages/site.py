"""Build the site, reports/index.html, from claims, figures, tables and metrics."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from pipeline.chapters.readable import rounded
from pipeline.report.claims import VERDICTS
from pipeline.report.reading import read
from pipeline.report.results import Results
from pipeline.report.site import build, check_place
from unmodelled.base.files import write_json
from unmodelled.base.ownership import Out, verb

#: Right answers in the summary (one effect, none, measured machines), and where they are in the metrics.
ANSWERS = {
    "effect": ("withheld", "single", "top1", "value"),
    "nothing": ("withheld", "null", "correct", "value"),
    "machines": ("real", "cases", "holds", "value"),
}


@verb(Out.SHARED)
def site(
    metrics: Path,
    claims: Path,
    tables: Path,
    figures: Path,
    provenance: Path,
    runs: Path,
    diagnoses: Path,
    executions: Path,
    full: Path,
    out: Path,
) -> None:
    """Write `out`/index.html, the folder `out`/site, `out`/claims.json and `out`/summary.json.

    The pages name missing inputs.

    Args:
        metrics: folder with <topic>.json, nested objects of numbers.
        claims: folder with <mechanism>/claims.json (claims of the dissertation with computed numbers and
            verdicts) and, if the physics is a system file, <mechanism>/equations.json.
        tables: folder with <name>.csv, each with an optional <name>.json (title, caption, protocol, chapter).
        figures: folder with SVG files and their list figures.json.
        provenance: folder with <campaign>/provenance.json.
        runs: folder that is searched for fit.json.
        diagnoses: folder that is searched for diagnoses with figures, as draw_diagnoses writes them.
        executions: folder with <stage>.json, the record of every executed stage.
        full: CSV file of the claims of a run with the full profile, site/tables/claims-index.csv of that run.
        out: folder in which these results are replaced as a whole; other files are kept.

    Raises:
        BadInput: when an input is damaged; nothing is written then.
    """
    check_place(out)
    results = read(metrics, claims, tables, figures, provenance, runs, diagnoses, executions, full)
    build(results, out)
    write_json(out / "claims.json", rounded(results.claims))
    write_json(out / "summary.json", summary(results))


def summary(results: Results) -> dict[str, Any]:
    """Return the numbers that `dvc metrics show` puts on one line: counts of verdicts, and right answers.

    Args:
        results: claims and metrics of all chapters.
    """
    said = Counter(VERDICTS[claim["verdict"]] for claim in results.claims)
    found: dict[str, Any] = {kind: said[kind] for kind in VERDICTS.values()}
    for name, path in ANSWERS.items():
        value: Any = results.metrics
        for key in path:
            value = value.get(key, {})
        found |= {name: value} if value != {} else {}
    return found
