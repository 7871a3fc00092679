"""The page of a training: what the networks have learned, and the machine with their formulas."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from unmodelled.report.diagnosis_tables import error_cell
from unmodelled.report.formula import formula
from unmodelled.report.headline import as_said, percent
from unmodelled.report.numbers import amounts, number, unit_text
from unmodelled.report.result_page import write_result_page
from unmodelled.report.tables import Cell, Table


def write_training_page(
    folder: Path,
    content: Mapping[str, Any],
    live: Mapping[str, Any],
    machine: Mapping[str, Any],
    laws: Mapping[str, bytes],
    losses: bytes,
) -> None:
    """Write index.html, the page of a training. Nothing in it comes from outside."""
    write_result_page(
        folder,
        "training.html.j2",
        [_errors(content), *([_parameters(content)] if content["parameters"] else [])],
        {"losses": losses, **{f"law {network}": drawn for network, drawn in laws.items()}},
        live,
        machine,
        content=content,
        sentence=_sentence(content),
        laws=[_law(law) for law in content["laws"]],
    )


def _sentence(content: Mapping[str, Any]) -> str:
    """What was learned where, and how far off the machine is with and without it."""
    learned = " and ".join(
        f"up to {amounts([law['largest']], law['unit'])[0]} at {law['port']}" for law in content["laws"]
    )
    name, entry = next((n, as_said(e)) for n, e in content["units"].items())
    values = [v for v in (entry["known"], entry["formulas"]) if v is not None]
    if len(values) < 2:
        return f"The networks have learned an effort of {learned}."
    before, after = amounts(values, entry["unit"])
    horizon = amounts([content["horizon"]], "s")[0]
    return (
        f"The networks have learned an effort of {learned}: with its formula, the error of {name} after "
        f"{horizon} is {after} instead of {before}."
    )


def _law(law: Mapping[str, Any]) -> dict[str, Any]:
    return {
        **law,
        "equation": formula(law["formula"], law["network"]),
        "said": f"{percent(law['explains'])} of the variance of the network's effort",
        "off": amounts([law["rmse"]], law["unit"])[0],
    }


def _errors(content: Mapping[str, Any]) -> Table:
    rows = []
    for name, entry in ((n, as_said(e)) for n, e in content["units"].items()):
        errors = (entry["known"], entry["formulas"], entry["formulas_whole_run"])
        unit = Cell(unit_text(entry["unit"]), entry["unit"])
        rows.append((Cell(name, name), *map(error_cell, errors), unit))
    after = f"after {number(content['horizon'])} s"
    columns = (
        "Output",
        f"Physics alone, {after}",
        f"With formulas, {after}",
        "With formulas, whole runs",
        "Unit",
    )
    about = (
        "Root mean square errors of free runs along all experiments, those of the training among them: in "
        "units of the outputs, at the last sample of the windows and over all samples of whole experiments."
    )
    return Table(
        "errors", "Errors of every output", columns, (False, True, True, True, False), tuple(rows), about
    )


def _parameters(content: Mapping[str, Any]) -> Table:
    rows = tuple(
        (
            Cell(row["parameter"], row["parameter"]),
            *(Cell(number(row[key]), repr(row[key])) for key in ("known", "median", "low", "high")),
            Cell(unit_text(row["unit"]), row["unit"]),
        )
        for row in content["parameters"]
    )
    columns = ("Parameter", "System file", "Identified (median)", "Lowest", "Highest", "Unit")
    about = f"Over the {content['models']} models of {content['folds']} folds."
    flags = (False, True, True, True, True, False)
    return Table("parameters", "Identified parameters", columns, flags, rows, about)
