"""The page of an identified distribution: what scatters by how much, and how sure that is."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from unmodelled.base.files import replacing
from unmodelled.report.diagnosis_page import PAGE, short
from unmodelled.report.machine_drawing import machine_drawing
from unmodelled.report.numbers import number
from unmodelled.report.rendering import one_file
from unmodelled.report.search import as_block, table_entries
from unmodelled.report.tables import Cell, Table

#: Method whose estimates have intervals.
EXACT = "push_forward"
#: Words for the numbers of a distribution.
WORDS = {"mu": "mean", "sigma": "standard deviation"}
#: Names of the methods.
METHODS = {"gaussian": "Gaussian", "maximum_entropy": "Maximum entropy", EXACT: "Push-forward (exact)"}


def write_uncertainty_page(
    folder: Path,
    content: Mapping[str, Any],
    estimates: list[dict[str, Any]],
    figures: Mapping[str, bytes],
    live: Mapping[str, Any] | None = None,
    machine: Mapping[str, Any] | None = None,
) -> None:
    """Write index.html, the page of an identified distribution. Nothing in it comes from outside.

    Args:
        folder: folder of the result.
        content: content of uncertainty.json.
        estimates: rows of the table of estimates.
        figures: SVG files `profiles` and `observations`.
        live: data of the machine that the page simulates; default None: there is no system.
        machine: names and units for the drawing of the machine; default None.

    Raises:
        BadInput: when the file cannot be written.
    """
    table = _estimates(estimates)
    text = one_file(
        "uncertainty.html.j2",
        live="" if live is None else as_block(live),
        content=content,
        sentence=_sentence(content, estimates, machine is not None),
        drawing=machine and machine_drawing({"effects": [], "where": {"channels": []}}, machine),
        figures={name: base64.b64encode(file).decode() for name, file in figures.items()},
        table=table,
        download=base64.b64encode(table.csv.encode()).decode(),
        search=as_block(table_entries([table], "")),
        short=short,
    )
    with replacing(folder / PAGE) as temporary:
        temporary.write_text(text)


def _sentence(content: Mapping[str, Any], estimates: list[dict[str, Any]], is_system: bool) -> str:
    """What scatters, with the limits of its numbers; they are named by the number of the parameter."""
    exact = [row for row in estimates if row["method"] == EXACT]
    parts = []
    for k, name in enumerate(content["parameters"], start=1):
        own = [row for row in exact if row["name"].endswith(f"_{k}")]
        parts.append(f"{name}: {', '.join(map(_number, own))}")
    of = " in multiples of the system file," if is_system else ""
    return f"{'; '.join(parts)},{of} from {content['observations']} observations."


def _number(row: Mapping[str, Any]) -> str:
    limits = [row[end] for end in ("low", "high")]
    shown = (
        ""
        if any(v != v for v in limits)
        else f" ({number(_short(limits[0]))} to {number(_short(limits[1]))})"
    )
    word = row["name"].rpartition("_")[0]
    return f"{WORDS.get(word, word)} {number(_short(row['value']))}{shown}"


def _short(value: float) -> float:
    return float(f"{value:.3g}")


def _estimates(estimates: list[dict[str, Any]]) -> Table:
    keys = ("value", "low", "high", "bootstrap_low", "bootstrap_high")
    rows = tuple(
        (
            Cell(METHODS.get(row["method"], row["method"]), row["method"]),
            Cell(row["name"], row["name"]),
            *(Cell("–" if row[k] != row[k] else number(row[k]), repr(row[k])) for k in keys),
        )
        for row in estimates
    )
    columns = ("Method", "Number", "Value", "Low", "High", "Low, bootstrap", "High, bootstrap")
    about = (
        "Limits of 95 % intervals of the exact method: by the profile likelihood, and from data sets that "
        "were drawn from the identified distribution. Parameters of a system file are in multiples of its "
        "values."
    )
    return Table("estimates", "Estimates", columns, (False, False, *(True,) * 5), rows, about)
