"""Build the tables on the patched robot file from the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from unmodelled.report.numbers import number, unit_text
from unmodelled.report.tables import Cell, Table

_MODELS = {
    "given": "the robot file as given",
    "patched": "the patched file",
    "supplemented": "the patched file with its supplement",
}


def changes_table(robot: Mapping[str, Any]) -> Table:
    """Return the numbers that the patched robot file changes."""
    rows = []
    for change in robot["changes"]:
        name = f"{change['element']}.{change['quantity']}"
        numbers = (_number(change[key], "none") for key in ("given", "patched"))
        rows.append((Cell(name, name), *numbers, Cell(unit_text(change["unit"]) or "–", change["unit"])))
    columns = "Number", "As given", "Patched", "Unit"
    about = "The equations have no dry friction of the robot file: frictionloss is what the diagnosis found."
    return Table(
        "robot_changes", "Numbers of the robot file", columns, (False, True, True, False), tuple(rows), about
    )


def replay_table(robot: Mapping[str, Any], held_out: list[str], horizon: float) -> Table:
    """Return the errors of the robot files in MuJoCo; horizon in s."""
    runs = {name: label for name, label in _MODELS.items() if name in robot["replay"]}
    rows: list[tuple[Cell, ...]] = []
    for name, label in runs.items():
        run = robot["replay"][name]
        rows.append(
            (Cell("gap", "gap"), Cell(label, name), _number(run["gap"]), Cell("–", ""), Cell("–", "1"))
        )
    for output in robot["replay"]["given"]["units"]:
        for name, label in runs.items():
            entry = robot["replay"][name]["units"][output]
            errors = (_number(entry[key], "diverges") for key in ("at_horizon", "whole_run"))
            unit = Cell(unit_text(entry["unit"]) or "–", entry["unit"])
            rows.append((Cell(output, output), Cell(label, name), *errors, unit))
    about = (
        f"Root mean square errors on {', '.join(map(str, held_out))}, which took no part in fitting: the gap "
        f"over windows of {number(horizon)} s in standard deviations of the outputs, and the errors of every "
        "output at the end of the windows and over whole runs."
    )
    columns = "Output", "In MuJoCo", f"After {number(horizon)} s", "Whole run", "Unit"
    flags = (False, False, True, True, False)
    return Table("robot_replay", "The robot file in MuJoCo", columns, flags, tuple(rows), about)


def robot_sentence(robot: Mapping[str, Any]) -> str:
    """Return how well the patched file follows the machine, beside the file as given."""
    replay = robot["replay"]
    name = "supplemented" if "supplemented" in replay else "patched"
    gaps = f"{_short(replay['given']['gap'])} as given and {_short(replay[name]['gap'])} with {_MODELS[name]}"
    lost = [output for output, entry in replay[name]["units"].items() if entry["whole_run"] is None]
    diverges = f" In whole runs, {', '.join(lost)} diverges." if lost else ""
    worse = replay["patched"]["gap"] >= replay["given"]["gap"]
    alone = " The patched file alone is no improvement: load it with its supplement." if worse else ""
    return f"In MuJoCo, the gap on the held-out experiments is {gaps}.{diverges}{alone}"


def _short(value: float) -> str:
    return number(float(f"{value:.3g}"))


def _number(value: float | None, nothing: str = "–") -> Cell:
    return Cell(nothing, "") if value is None else Cell(number(value), str(value))
