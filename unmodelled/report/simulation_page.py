"""The page of a simulation: how far off a model is, where, and the machine that follows its sliders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from unmodelled.report.diagnosis_tables import error_cell
from unmodelled.report.headline import as_said
from unmodelled.report.numbers import amounts, number, unit_text
from unmodelled.report.result_page import write_result_page
from unmodelled.report.tables import Cell, Table

#: Outputs that the first sentence tells.
MANY = 2


def write_simulation_page(
    folder: Path,
    content: Mapping[str, Any],
    live: Mapping[str, Any],
    machine: Mapping[str, Any],
    drawn: bytes,
) -> None:
    """Write index.html, the page of a simulation. Nothing in it comes from outside."""
    write_result_page(
        folder,
        "simulation.html.j2",
        [_errors(content), _experiments(content)],
        {"worst": drawn},
        live,
        machine,
        content=content,
        sentence=_sentence(content),
        worst=live["experiments"][0]["id"],
    )


def _sentence(content: Mapping[str, Any]) -> str:
    """How far off every output is, in its unit; the worst outputs alone where there are many."""
    after = amounts([content["horizon"]], "s")[0]
    worst = sorted(content["outputs"], key=lambda name: -content["outputs"][name]["gap"])[:MANY]
    told = [_off(name, as_said(content["gap"]["units"][name]), after) for name in worst]
    more = " The other outputs are closer." if len(worst) < len(content["outputs"]) else ""
    return f"{'; '.join(told)}.{more}"


def _off(name: str, entry: Mapping[str, Any], after: str) -> str:
    near, far = (entry["known"], entry["known_whole_run"])
    if near is None:
        return f"{name} diverges within {after}"
    said = f"{name} is {amounts([near], entry['unit'])[0]} off after {after}"
    return f"{said}, and {'diverges' if far is None else amounts([far], entry['unit'])[0]} over whole runs"


def _errors(content: Mapping[str, Any]) -> Table:
    rows = []
    for name, entry in ((n, as_said(e)) for n, e in content["gap"]["units"].items()):
        errors = (entry["known"], entry["known_whole_run"], content["outputs"][name]["gap"])
        unit = Cell(unit_text(entry["unit"]), entry["unit"])
        rows.append((Cell(name, name), *map(error_cell, errors), unit))
    columns = ("Output", f"After {number(content['horizon'])} s", "Whole runs", "Gap", "Unit")
    about = (
        "Root mean square errors in units of the outputs, at the last sample of the free-run windows and "
        "over all samples of whole experiments; the gap in standard deviations of the outputs."
    )
    flags = (False, True, True, True, False)
    return Table("errors", "Errors of every output", columns, flags, tuple(rows), about)


def _experiments(content: Mapping[str, Any]) -> Table:
    ordered: Sequence[Mapping[str, Any]] = sorted(content["experiments"], key=lambda row: -row["known"])
    rows = tuple((Cell(row["id"], row["id"]), error_cell(row["known"])) for row in ordered)
    about = "In standard deviations of the outputs, the largest first."
    return Table("experiments", "Gap of every experiment", ("Experiment", "Gap"), (False, True), rows, about)
