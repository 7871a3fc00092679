"""Pages of results: one file with tables, figures and, where there is one, the machine itself.

Nothing in a page comes from outside.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from unmodelled.base.files import replacing
from unmodelled.base.sure_numbers import as_said
from unmodelled.report.diagnosis_page import PAGE, with_scales
from unmodelled.report.formula import formula
from unmodelled.report.headline import percent
from unmodelled.report.machine_drawing import machine_drawing
from unmodelled.report.numbers import amounts, number, short
from unmodelled.report.rendering import one_file
from unmodelled.report.search import as_block, table_entries
from unmodelled.report.tables import Cell, Table, error_cell, number_cell, unit_cell

Content = Mapping[str, Any]

#: What a drawing marks: nothing is missing anywhere.
_NOTHING: Content = {"effects": [], "where": {"channels": []}}
#: Outputs that the first sentence of a simulation tells.
MANY = 2
#: Method of an identified distribution whose estimates have intervals, and names of the methods.
EXACT = "push_forward"
METHODS = {"gaussian": "Gaussian", "maximum_entropy": "Maximum entropy", EXACT: "Push-forward (exact)"}
#: Words for the numbers of a distribution.
WORDS = {"mu": "mean", "sigma": "standard deviation"}


def write_simulation_page(
    folder: Path, content: Content, live: Content, machine: Content, drawn: bytes
) -> None:
    """Write index.html, the page of a simulation: how far off a model is, where, and the machine."""
    ordered = sorted(content["experiments"], key=lambda row: -row["known"])
    rows = tuple((Cell(row["id"], row["id"]), error_cell(row["known"])) for row in ordered)
    about = "In standard deviations of the outputs, the largest first."
    gaps = Table("experiments", "Gap of every experiment", ("Experiment", "Gap"), (False, True), rows, about)
    errors = _errors(
        content["gap"]["units"],
        lambda name, e: (e["known"], e["known_whole_run"], content["outputs"][name]["gap"]),
        ("Output", f"After {number(content['horizon'])} s", "Whole runs", "Gap", "Unit"),
        "Root mean square errors in units of the outputs, at the last sample of the free-run windows and "
        "over all samples of whole experiments; the gap in standard deviations of the outputs.",
    )
    write_result_page(
        *(folder, "simulation.html.j2", [errors, gaps], {"worst": drawn}, live, machine),
        content=content,
        sentence=_simulated(content),
        worst=live["experiments"][0]["id"],
    )


def write_training_page(
    folder: Path, content: Content, live: Content, machine: Content, laws: Mapping[str, bytes], losses: bytes
) -> None:
    """Write index.html, the page of a training: what networks have learned, and the machine with formulas."""
    after = f"after {number(content['horizon'])} s"
    errors = _errors(
        content["units"],
        lambda _, e: (e["known"], e["formulas"], e["formulas_whole_run"]),
        (
            *("Output", f"Physics alone, {after}", f"With formulas, {after}", "With formulas, whole runs"),
            "Unit",
        ),
        "Root mean square errors of free runs along all experiments, those of the training among them: in "
        "units of the outputs, at the last sample of the windows and over all samples of whole experiments.",
    )
    shown = [
        {
            **law,
            "equation": formula(law["formula"], law["network"]),
            "said": f"{percent(law['explains'])} of the variance of the network's effort",
            "off": amounts([law["rmse"]], law["unit"])[0],
        }
        for law in content["laws"]
    ]
    write_result_page(
        folder,
        "training.html.j2",
        [errors, *([_parameters(content)] if content["parameters"] else [])],
        {"losses": losses, **{f"law {network}": drawn for network, drawn in laws.items()}},
        *(live, machine),
        content=content,
        sentence=_learned(content),
        laws=shown,
    )


def write_uncertainty_page(
    folder: Path,
    content: Content,
    estimates: list[dict[str, Any]],
    figures: Mapping[str, bytes],
    live: Content | None,
    machine: Content | None,
) -> None:
    """Write index.html, the page of an identified distribution: what scatters by how much, how sure it is."""
    sentence = _scattered(content, estimates, machine is not None)
    about = {"content": content, "sentence": sentence}
    tables = [_estimates(estimates)]
    write_result_page(folder, "uncertainty.html.j2", tables, figures, live, machine, **about)


def write_result_page(
    folder: Path,
    template: str,
    tables: Sequence[Table],
    figures: Mapping[str, bytes],
    live: Content | None,
    machine: Content | None,
    **values: Any,
) -> None:
    """Write index.html to a folder: a template with tables, figures and, where there is one, the machine."""
    text = one_file(
        template,
        live="" if live is None else as_block(with_scales(live)),
        drawing="" if machine is None else machine_drawing(_NOTHING, machine),
        tables=[(table, _encoded(table.csv.encode())) for table in tables],
        figures={name: _encoded(file) for name, file in figures.items()},
        search=as_block(table_entries(tables, "")),
        short=short,
        **values,
    )
    with replacing(folder / PAGE) as temporary:
        temporary.write_text(text)


def _encoded(file: bytes) -> str:
    return base64.b64encode(file).decode()


def _errors(
    units: Content,
    errors: Callable[[str, Content], Sequence[float | None]],
    columns: tuple[str, ...],
    about: str,
) -> Table:
    """Three errors of every output, which `errors` finds in its entry."""
    entries = {name: as_said(entry) for name, entry in units.items()}
    rows = tuple(
        (Cell(name, name), *map(error_cell, errors(name, entry)), unit_cell(entry["unit"]))
        for name, entry in entries.items()
    )
    return Table("errors", "Errors of every output", columns, (False, True, True, True, False), rows, about)


def _simulated(content: Content) -> str:
    """How far off every output is, in its unit; the worst outputs alone where there are many."""
    after = amounts([content["horizon"]], "s")[0]
    worst = sorted(content["outputs"], key=lambda name: -content["outputs"][name]["gap"])[:MANY]
    told = [_off(name, as_said(content["gap"]["units"][name]), after) for name in worst]
    more = " The other outputs are closer." if len(worst) < len(content["outputs"]) else ""
    return f"{'; '.join(told)}.{more}"


def _off(name: str, entry: Content, after: str) -> str:
    near, far = entry["known"], entry["known_whole_run"]
    if near is None:
        return f"{name} diverges within {after}"
    said = f"{name} is {amounts([near], entry['unit'])[0]} off after {after}"
    return f"{said}, and {'diverges' if far is None else amounts([far], entry['unit'])[0]} over whole runs"


def _learned(content: Content) -> str:
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


def _parameters(content: Content) -> Table:
    rows = tuple(
        (
            Cell(row["parameter"], row["parameter"]),
            *(number_cell(row[key]) for key in ("known", "median", "low", "high")),
            unit_cell(row["unit"]),
        )
        for row in content["parameters"]
    )
    columns = ("Parameter", "System file", "Identified (median)", "Lowest", "Highest", "Unit")
    about = f"Over the {content['models']} models of {content['folds']} folds."
    return Table("parameters", "Identified parameters", columns, (False, *(True,) * 4, False), rows, about)


def _scattered(content: Content, estimates: list[dict[str, Any]], is_system: bool) -> str:
    """What scatters, with the limits of its numbers; they are named by the number of the parameter."""
    exact = [row for row in estimates if row["method"] == EXACT]
    parts = []
    for k, name in enumerate(content["parameters"], start=1):
        own = [row for row in exact if row["name"].endswith(f"_{k}")]
        parts.append(f"{name}: {', '.join(map(_estimate, own))}")
    of = " in multiples of the system file," if is_system else ""
    return f"{'; '.join(parts)},{of} from {content['observations']} observations."


def _estimate(row: Content) -> str:
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
            *(number_cell(row[key]) for key in keys),
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
