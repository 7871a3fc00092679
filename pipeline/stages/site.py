"""Build the site, reports/index.html, from claims, figures, tables and metrics."""

from __future__ import annotations

from pathlib import Path

from pipeline.report.reading import read
from pipeline.report.site import build, check_place
from unmodelled.base.files import write_json
from unmodelled.base.ownership import Out, verb


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
    """Write `out`/index.html, the folder `out`/site and `out`/claims.json.

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
        out: folder in which these three results are replaced as a whole; other files are kept.

    Raises:
        BadInput: when an input is damaged; nothing is written then.
    """
    check_place(out)
    results = read(metrics, claims, tables, figures, provenance, runs, diagnoses, executions, full)
    build(results, out)
    write_json(out / "claims.json", results.claims)
