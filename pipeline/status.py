"""Draw the stage graph, what `dvc repro` would run, and when each stage ran: python -m pipeline.status

The digests of code and configuration are written first, so that `dvc repro --dry` is right afterwards, too.
"""

import json
import re
import shutil
import subprocess
import sys
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline import digests
from pipeline.__main__ import EXECUTIONS
from pipeline.report.numbers import duration

Edges = Mapping[str, set[str]]

LEGEND = """\
reads: a column begins at the stage that writes; * stands where a stage reads it. Every stage reads code, too.
run: cells that `dvc repro` runs; + may run: those that read what such a cell writes, if it differs then."""


@dataclass
class Row:
    """Cells of one stage."""

    cells: list[str] = field(default_factory=list)  # full names, train@f_h1-interpolation
    reads: set[str] = field(default_factory=set)  # names of stages
    seconds: float = 0.0  # of the last run, cells added up, s
    finished: str = ""  # date and time of the last run, UTC


def read_edges(dot: str) -> dict[str, set[str]]:
    """Return the stages that each stage reads, from the output of `dvc dag --dot`, writers first."""
    names, pairs = re.findall(r'^"([^"]+)";$', dot, re.M), re.findall(r'^"([^"]+)" -> "([^"]+)";$', dot, re.M)
    left: dict[str, set[str]] = {name: set() for name in names}
    for writer, reader in pairs:
        left[reader].add(writer)
    ordered: dict[str, set[str]] = {}
    while left:
        name = next(name for name, reads in left.items() if reads <= ordered.keys())
        ordered[name] = left.pop(name)
    return ordered


def readers_of(changed: set[str], edges: Edges) -> set[str]:
    """Return all stages that read what `changed` write, directly or not, without `changed`."""
    found = set(changed)
    for name, reads in edges.items():  # writers first
        if reads & found:
            found.add(name)
    return found - changed


def stage_of(cell: str) -> str:
    """Return the name of a stage in dvc.yaml from that of one of its cells."""
    return cell.partition("@")[0]


def rows_of(edges: Edges, folder: Path) -> dict[str, Row]:
    """Return all stages with their cells, and what `folder` notes of their last runs."""
    rows: dict[str, Row] = defaultdict(Row)
    for cell, reads in edges.items():
        rows[stage_of(cell)].cells.append(cell)
        rows[stage_of(cell)].reads |= set(map(stage_of, reads))
    for file in folder.glob("*.json"):
        about = json.loads(file.read_text())
        if row := rows.get(stage_of(about["stage"])):
            row.seconds += about["seconds"]
            row.finished = max(row.finished, about["finished"][:16].replace("T", " "))
    return dict(rows)


def drawing(rows: Mapping[str, Row], stale: set[str], may: set[str]) -> str:
    """Draw one line per stage: name, what it reads, cells to run, date and duration of its last run."""
    names = [name for name in rows if name != "code"]
    last = {
        name: max((i for i, n in enumerate(names) if name in rows[n].reads), default=-1) for name in names
    }
    lines = [f"{'stage':<22}{'reads':<{len(names) + 2}}{'run':<10}last run, UTC      time"]
    for i, name in enumerate([*names, "code"]):
        row, before = rows[name], names[: i + 1] if name != "code" else []
        lanes = "".join(_lane(i, j, writer, row, last) for j, writer in enumerate(before))
        lines.append(f"{name:<22}{lanes:<{len(names) + 2}}{_cells(row, stale, may):<10}{_last(row)}".rstrip())
    return "\n".join(lines)


def _lane(i: int, j: int, writer: str, row: Row, last: Mapping[str, int]) -> str:
    if i == j:
        return "┐" if last[writer] > i else " "
    return "*" if writer in row.reads else "│" if last[writer] > i else " "


def _cells(row: Row, stale: set[str], may: set[str]) -> str:
    run, perhaps = len(stale & set(row.cells)), len(may & set(row.cells))
    parts = [str(run) if run else "", f"+ {perhaps}" if perhaps else ""]
    return " ".join(filter(None, parts)) + f" of {len(row.cells)}" if run or perhaps else "-"


def _last(row: Row) -> str:
    return f"{row.finished:<19}{duration(row.seconds)}" if row.finished else ""


def _dvc(*arguments: str) -> str:
    program = shutil.which("dvc", path=str(Path(sys.executable).parent)) or "dvc"
    return subprocess.run([program, *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout


def status(changes: Mapping[str, Any], dot: str, folder: Path) -> str:
    """Return the drawing from the output of `dvc status --json` and `dvc dag --dot`, and a line in words."""
    edges = read_edges(dot)
    stale = set(changes)
    # the digests are written: all that they change is known
    may = readers_of(stale - {"code"}, edges) - stale
    rows = rows_of(edges, folder)
    seconds = sum(row.seconds for row in rows.values() if stale & set(row.cells))
    told = f"{len(stale)} cells run, {len(may)} may run, {len(edges) - len(stale | may)} are up to date"
    cost = f"; the last runs of those that run took {duration(seconds)}, cells added up" if seconds else ""
    return f"{drawing(rows, stale, may)}\n\n{LEGEND}\n{told}{cost}."


def main() -> int:
    """Print the status of the checkout in the working directory; return the exit code."""
    digests.main()
    try:
        print(status(json.loads(_dvc("status", "--json")), _dvc("dag", "--dot"), EXECUTIONS))
    except subprocess.CalledProcessError as error:
        return int(error.returncode)  # DVC has said why
    return 0


if __name__ == "__main__":
    sys.exit(main())
