"""Tabulate the diagnoses of measured machines, and compare them with what is known from elsewhere."""

from __future__ import annotations

from pathlib import Path

from pipeline.chapters import real
from pipeline.chapters.known import read_machines
from pipeline.chapters.readable import write_metrics, write_table
from unmodelled.base.ownership import verb

TITLES = {
    "real": "What is known from elsewhere, and what the diagnosis says",
    "real_numbers": "Identified numbers and their references",
    "real_gaps": "Gaps on held-out experiments",
    "real_left_over": "Place of the gap, and remaining gap",
}


@verb()
def tabulate_real(diagnoses: Path, systems: Path, profile_name: str, reports: Path) -> None:
    """Write metrics/real.json and tables/real.csv, real_numbers.csv, real_gaps.csv and real_left_over.csv.

    A machine without a diagnosis has rows in real.csv that say how to give its data.

    Args:
        diagnoses: folder with <machine>/<withheld>_withheld as written by diagnose_systems; may be missing.
        systems: folder with <machine>/known.yaml.
        profile_name: profile of the graph; a diagnosis is the same in all profiles.
        reports: folder in which the files named above are rewritten.

    Raises:
        BadInput: when known.yaml of a machine or a diagnosis is damaged.
    """
    machines = read_machines(systems)
    found = real.read_diagnoses(diagnoses, machines)
    data = "virtual" if any(one.data == "virtual" for one in found) else "measured"
    judgements = real.judgements(found, machines)
    tables = {
        "real": judgements,
        "real_numbers": real.numbers(found),
        "real_gaps": real.gaps(found),
        "real_left_over": real.left_over(found),
    }
    for name, table in tables.items():
        write_table(reports / "tables" / name, table, None, TITLES[name], real.PROTOCOL, data)
    counts = {
        answer: {"value": int((judgements[answer] == "yes").sum()), "unit": "cases", "n": len(found)}
        for answer in ("holds", "harmful")
    }
    known, diagnosed = ({"value": len(rows), "unit": "cases"} for rows in (judgements, found))
    cases = {"known": known, "diagnosed": diagnosed, **counts}
    by_machine: dict[str, dict[str, object]] = {}
    for one in found:
        by_machine.setdefault(one.machine, {})[one.withheld] = real.leaves(one.report)
    numbers = {"protocol": real.PROTOCOL, "cases": cases, **by_machine}
    write_metrics(reports, "real", data, profile_name, numbers)
    for row in judgements.to_dict("records"):
        failed = f"; failed at {row['failed at']}" if row["holds"] == "no" else ""
        print(f"{row['machine']}, {row['withheld']} withheld: {row['verdict']}: {row['effects']}{failed}")
