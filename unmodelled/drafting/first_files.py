"""A first mapping and system file for a recorder's files, as texts by their paths."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from unmodelled.base.errors import BadInput, printable
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.draft import Draft, draft_of
from unmodelled.drafting.left_out import left_out
from unmodelled.drafting.mapping_text import mapping_text
from unmodelled.drafting.names import Role
from unmodelled.drafting.robot_text import robot_system_text, with_goals
from unmodelled.drafting.system_text import system_text
from unmodelled.logs.mapping import MAPPING
from unmodelled.systems.robot.compile import MOST_JOINTS
from unmodelled.systems.robot.files import robot_text

#: Rows of the table of the columns.
ROWS = 40


@dataclass(frozen=True)
class FirstFiles:
    """Drafted files, which are not written yet."""

    mapping: Path
    system: Path
    logs: Path  # what other verbs take as logs
    texts: dict[Path, str]  # by path, with a copy of a robot file that lies elsewhere
    table: str  # of the columns, to be printed


def first_files(logs: Path, robot: Path | None, system: Path | None, out: Path | None) -> FirstFiles:
    """Draft a mapping and a system file; refuse paths that exist."""
    if out is not None and out.suffix in (".yaml", ".yml"):
        raise BadInput(f"out={out}: must be a folder, in which {MAPPING} is written")
    folder = logs if logs.is_dir() else logs.parent
    place = out or folder
    mapping, file = place / MAPPING, system or place / "system.yaml"
    if out is None and logs.is_dir() and (logs / "experiments.csv").exists():
        raise BadInput(f"{logs}: is a log folder already (experiments.csv): write the system file by hand")
    copies = {} if robot is None else _copies(robot, file.parent)
    for path in (mapping, file, *copies):
        if path.exists():
            raise BadInput(f"{path}: exists, and is not overwritten: remove it, or give another out=...")
    found = draft_of(logs) if robot is None else with_goals(draft_of(logs, MOST_JOINTS), robot)
    seen = Path(os.path.relpath(found.survey.folder.resolve(), place.resolve())).as_posix()
    name = logs.resolve().stem
    texts = {
        mapping: mapping_text(found, seen),
        file: system_text(found, name) if robot is None else robot_system_text(found, robot, name),
        **copies,
    }
    given = mapping if (place / "experiments.csv").exists() else place
    return FirstFiles(mapping, file, given, texts, _table(found))


def _copies(robot: Path, folder: Path) -> dict[Path, str]:
    """The robot file as text by its path beside the system file; none if it is there already."""
    path = folder / robot.name
    return {} if path.exists() and path.samefile(robot) else {path: robot_text(robot)}


def _table(draft: Draft) -> str:
    """A table with a row per column: samples, rate, range, unit, and what it looks like."""
    found: dict[str, list[Signal]] = {}
    for signals in draft.experiments:
        for signal in signals:
            found.setdefault(signal.address, []).append(signal)
    # unit, symbol and kind of every column that is used
    used = {
        each.channel.signal.address: (
            each.channel.signal.unit or each.channel.unit,
            f"{each.symbol}, {each.kind}",
        )
        for each in draft.used
    }
    rows: list[tuple[str, ...]] = [("column", "rate", "from", "to", "unit", "looks like")]
    for address in sorted(found, key=lambda each: each not in used):
        parts = found[address]
        low, high = min(p.values.min() for p in parts), max(p.values.max() for p in parts)
        roles = [role.value for role in dict.fromkeys((parts[0].role, Role.OTHER)) if role is not None]
        unit, likeness = used.get(address) or (parts[0].unit or "?", ", ".join(roles))
        numbers = (f"{parts[0].rate:.4g} Hz", f"{low:.4g}", f"{high:.4g}")
        rows.append((printable(address), *numbers, printable(unit), likeness))
    shown = rows[: ROWS + 1]
    widths = [max(len(row[j]) for row in shown) for j in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in shown]
    more = [f"and {len(rows) - len(shown)} more columns"] if len(rows) > len(shown) else []
    return "\n".join([*lines, *more, *left_out(draft)])
