"""The page of an identified distribution: what scatters by how much, and how sure that is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from unmodelled.report.diagnosis_page import short
from unmodelled.report.numbers import number
from unmodelled.report.result_page import write_result_page
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
    """Write index.html, the page of an identified distribution. Nothing in it comes from outside."""
    write_result_page(
        folder,
        "uncertainty.html.j2",
        [_estimates(estimates)],
        figures,
        live,
        machine,
        content=content,
        sentence=_sentence(content, estimates, machine is not None),
    )


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
    shown = "" if any(v != v for v in limits) else f" ({short(limits[0])} to {short(limits[1])})"
    word = row["name"].rpartition("_")[0]
    return f"{WORDS.get(word, word)} {short(row['value'])}{shown}"


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
