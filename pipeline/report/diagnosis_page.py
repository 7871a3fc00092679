"""The page of a diagnosis: one file that opens from disk."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.files import read_json, replacing
from pipeline.report.diagnosis_tables import (
    GAPS,
    candidates_table,
    effect_name,
    experiments_table,
    gap_table,
    identified_table,
    parameter_tables,
    where_tables,
)
from pipeline.report.formula import formula
from pipeline.report.pages import Figure
from pipeline.report.site import HERE, ORIGINS, read_figures, templates
from pipeline.report.tables import Table, number

PAGE = "index.html"


def write_page(folder: Path, command: str) -> None:
    """Write `folder`/index.html from diagnosis.json and the folders `tables` and `figures`.

    The tables on it are written as CSV files beside those it was made from. Style, script and figures are in
    the file itself.

    Args:
        folder: of the diagnosis. command: that made it.

    Raises:
        BadInput: when a file is missing, damaged or cannot be written.
    """
    content, about = read_json(folder / "diagnosis.json"), read_json(folder / "tables" / "about.json")
    shown = _contents(content, about, read_figures(folder / "figures"), command)
    text = templates().get_template("diagnosis.html.j2").render(**shown)
    for figure in shown["figures"].values():
        address = f"figures/{figure.source.name}"
        data = base64.b64encode(figure.source.read_bytes()).decode()
        text = text.replace(f'src="{address}"', f'src="data:image/svg+xml;base64,{data}"')
    for table in shown["tables"]:
        with replacing(folder / "tables" / f"{table.id}.csv") as temporary:
            temporary.write_text(table.csv)
    with replacing(folder / PAGE) as temporary:
        temporary.write_text(text)


def _contents(
    content: Mapping[str, Any], about: Mapping[str, Any], figures: list[Figure], command: str
) -> dict[str, Any]:
    """What the template is given."""
    units = about["units"]
    effects = parameter_tables(content)
    where = where_tables(content, units)
    others = {
        "gap": gap_table(content),
        "experiments": experiments_table(content),
        "identified": identified_table(content, units),
        "candidates": candidates_table(content),
    }
    tables, static = [*effects, *where, *others.values()], HERE / "static"
    return {
        "content": content,
        "about": about,
        "headline": headline(content),
        "summary": _summary(content),
        "partial": bool(content.get("partial")),
        "effects": [_effect(e, t, about) for e, t in zip(content["effects"], effects, strict=True)],
        "where": where,
        **others,
        "tables": tables,
        "figures": {figure.id: figure for figure in figures},
        "command": command,
        "origin": about["data"],
        "banner": ORIGINS[about["data"]] if about["data"] else "",
        "short": short,
        "percent": percent,
        "root": "",
        "style": (static / "style.css").read_text(),
        "script": (static / "report.js").read_text(),
        "search": _search(figures, tables),
    }


def headline(content: Mapping[str, Any]) -> str:
    """The verdict in one sentence."""
    names = [effect_name(effect) for effect in content["effects"]]
    together, shrink = " and ".join(names), percent(content["gap"]["shrink"])
    if content["verdict"] == "no_gap":
        return "No gap beyond the noise of the sensors."
    if content["verdict"] == "effect":
        verb = "explains" if len(names) == 1 else "explain"
        return f"{together[:1].upper()}{together[1:]} {verb} {shrink} of the gap."
    first = content["where"]["channels"][:1]
    found = [f"{percent(row['share'])} of it enters at {row['port']}" for row in first]
    found += [f"{together} would explain {shrink}"] if names else []
    return "; ".join(["A gap that no known effect explains", *found]) + "."


def percent(value: float | None) -> str:
    """A share; never rounded to all of something."""
    if value is None:
        return "–"
    share = 100.0 * value
    return f"{share:.1f}\u202f%" if 99.0 < share < 99.95 else f"{share:.0f}\u202f%"


def short(value: float | None) -> str:
    """Three digits."""
    return number(value if value is None else float(f"{value:.3g}"))


def _summary(content: Mapping[str, Any]) -> str:
    gap = {name: short(value) for name, value in content["gap"].items() if name in GAPS}
    found = (
        "On experiments that took no part in fitting or choosing, the model as given is off by "
        f"{gap['known']} standard deviations of the outputs, with refitted parameters by "
        f"{gap['reidentified']}"
    )
    found += f", with the effects found by {gap['augmented']}" if content["effects"] else ""
    return f"{found}; the noise of the sensors alone leaves {gap['floor']}."


def _effect(effect: Mapping[str, Any], table: Table, about: Mapping[str, Any]) -> dict[str, Any]:
    kind, _, name = str(effect["port"]).rpartition(":")
    left = {
        "": about["channels"].get(name, {}).get("symbol", name),
        "actuator": f"{name} as it acts",
        "sensor": f"{name} as it is shown",
    }
    return {
        **effect,
        "name": effect_name(effect),
        "equation": formula(effect["law"], left.get(kind, name)),
        "table": table,
        "alike": [effect_name(other) for other in effect["indistinguishable"]],
    }


def _search(figures: list[Figure], tables: list[Table]) -> str:
    """What the search box looks through, as JSON that cannot end a script."""
    found = [("figure", f"Figure {f.number}", f.caption, f.id) for f in figures]
    found += [("table", t.title, t.caption, t.id) for t in tables if t.rows]
    rows = [{"kind": kind, "title": title, "text": text, "url": f"#{id}"} for kind, title, text, id in found]
    return json.dumps(rows).replace("<", "\\u003c")
