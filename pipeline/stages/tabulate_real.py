"""Tabulate the diagnoses of measured machines: identified effects and remaining errors."""

from __future__ import annotations

from pathlib import Path

from pipeline.chapters import real
from pipeline.chapters.readable import write_table
from pipeline.revision import revision
from unmodelled.base.files import write_json
from unmodelled.base.ownership import verb
from unmodelled.base.shapes import ORIGIN, read_shaped

TITLES = {
    "": "What the diagnosis says",
    "_numbers": "Identified numbers",
    "_left_over": "Where the gap lies, and what is left",
}


@verb()
def tabulate_real(diagnoses: Path, raw: Path, profile_name: str, reports: Path) -> None:
    """Write metrics/real.json, and tables/<machine>.csv, <machine>_numbers.csv and <machine>_left_over.csv.

    Args:
        diagnoses: folder with <machine>/<what>_withheld/diagnosis.json as written by diagnose.
        raw: folder with <machine>/provenance.json.
        profile_name: name of the profile of the graph; a diagnosis is the same in all profiles.
        reports: folder in which these files are rewritten.

    Raises:
        BadInput: when there is no diagnosis, or a machine's provenance is missing.
    """
    found = real.read_diagnoses(diagnoses)
    kinds = {
        machine: str(read_shaped(raw / machine / "provenance.json", ORIGIN)["data"]) for machine in found
    }
    for machine, reports_of in found.items():
        parts = {
            "": real.verdicts(reports_of),
            "_numbers": real.numbers(reports_of),
            "_left_over": real.left_over(reports_of),
        }
        for suffix, table in parts.items():
            path = reports / "tables" / f"{machine}{suffix}"
            write_table(path, table, None, TITLES[suffix], real.PROTOCOL, kinds[machine])
    head = {
        "data": "measured" if set(kinds.values()) == {"measured"} else "virtual",
        "profile": profile_name,
        "revision": revision(),
        "seconds": 0.0,
        "protocol": real.PROTOCOL,
    }
    leaves = {m: {what: real.leaves(report) for what, report in r.items()} for m, r in found.items()}
    write_json(reports / "metrics" / "real.json", {**head, **leaves})
