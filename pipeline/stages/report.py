"""Build the report, reports/index.html, from claims, figures, tables and metrics."""

from __future__ import annotations

from pathlib import Path

from pipeline.report.reading import read
from pipeline.report.site import build, check_place
from unmodelled.base.files import write_json
from unmodelled.base.ownership import Out, verb


@verb(Out.SHARED)
def report(
    metrics: Path,
    claims: Path,
    tables: Path,
    figures: Path,
    provenance: Path,
    runs: Path,
    diagnoses: Path,
    executions: Path,
    out: Path,
) -> None:
    """Write `out`/index.html, the folder `out`/site and `out`/claims.json.

    The pages say which inputs do not exist yet.

    Args:
        metrics: folder of <topic>.json, nested objects of numbers.
        claims: folder of <mechanism>/claims.json, the dissertation's claims with our numbers and verdicts,
            and, where the physics is a system file, <mechanism>/equations.json.
        tables: folder of <name>.csv, each with an optional <name>.json (title, caption, protocol, chapter).
        figures: folder of SVG files and figures.json, which says what they show.
        provenance: folder of <campaign>/provenance.json.
        runs: folder that is searched for fit.json.
        diagnoses: folder that is searched for diagnoses with figures, as draw_diagnoses writes them.
        executions: folder of <stage>.json, what was noted of every stage that was executed.
        out: folder; these three in it are replaced as a whole, anything else in it is left alone.

    Raises:
        BadInput: when an input is damaged; nothing is written.
    """
    check_place(out)
    results = read(metrics, claims, tables, figures, provenance, runs, diagnoses, executions)
    build(results, out)
    write_json(out / "claims.json", results.claims)
