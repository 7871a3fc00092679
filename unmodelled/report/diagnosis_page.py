"""The page of a diagnosis: one file that opens from disk, or the same in the frame of a site."""

from __future__ import annotations

import base64
import os
import shlex
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, replacing
from unmodelled.base.kind_words import kind_name, kind_sentence, strangers_sentence
from unmodelled.base.next_step import AUGMENTED, next_step
from unmodelled.base.sure_numbers import as_said, doubt
from unmodelled.base.wording import effect_name, place_name
from unmodelled.report.diagnosis_tables import (
    chain_table,
    changes_table,
    comparison_table,
    evidence_table,
    experiments_table,
    gap_table,
    identified_table,
    parameter_tables,
    replay_table,
    robot_sentence,
    units_table,
    where_tables,
)
from unmodelled.report.drawn import read_figures
from unmodelled.report.formula import formula
from unmodelled.report.headline import (
    UNEXPLAINED,
    fallen,
    headline,
    left_looks_like,
    outcome,
    percent,
    rankings,
    remains,
)
from unmodelled.report.machine_drawing import machine_drawing
from unmodelled.report.numbers import amounts, number, short
from unmodelled.report.rendering import ORIGINS, one_file
from unmodelled.report.search import as_block, figure_entries, row_entries, table_entries
from unmodelled.report.tables import Table
from unmodelled.systems.units import parse_logged

PAGE = "index.html"
#: What the augmented system file changes, in the folder of the tables.
CHANGES = "augmented_system.diff"
#: Lines of that which a page shows.
MOST_LINES = 200


def write_page(folder: Path, command: str) -> None:
    """Write index.html, the page of a diagnosis, from diagnosis.json and the folders `tables` and `figures`.

    The tables of the page are also written as CSV files into `tables`. The page names the command. It
    contains its style, scripts, figures and, where tables/live.json exists, the machine that it simulates.
    Its content security policy allows these scripts by their digests only: names and logs are data.
    """
    shown = {**view(folder), "command": command}
    figures, tables = shown["figures"].values(), shown["tables"]
    entries = [*figure_entries(figures, ""), *table_entries(tables, ""), *row_entries(tables, "")]
    search = as_block(entries)
    text = one_file("diagnosis.html.j2", live=live_data(folder, shown), search=search, **shown)
    for figure in figures:
        address = f"figures/{figure.source.name}"
        data = base64.b64encode(figure.source.read_bytes()).decode()
        text = text.replace(f'src="{address}"', f'src="data:image/svg+xml;base64,{data}"')
    for table in tables:
        with replacing(folder / "tables" / f"{table.id}.csv") as temporary:
            temporary.write_text(table.csv)
    with replacing(folder / PAGE) as temporary:
        temporary.write_text(text)


def command_of(content: Mapping[str, Any], out: Path | None = None) -> str:
    """Return the command line that gives an answer; none where system or logs are no files.

    Paths are those from the working folder, as the user would write them there.
    """
    kept = content.get("sources")
    files = kept if isinstance(kept, dict) else {}
    if not (files.get("system") and files.get("logs")):
        return ""
    words = {name: os.path.relpath(files[name]) for name in ("system", "logs", "laws") if files.get(name)}
    words |= {"horizon": f"{content['gap']['horizon']}", "seed": f"{content['seed']}"}
    if changed := content.get("options"):
        words["options"] = "{" + ", ".join(f"{name}: {value}" for name, value in changed.items()) + "}"
    if left_out := content.get("without"):
        words["without"] = f"[{','.join(left_out)}]"
    words |= {} if out is None else {"out": os.path.relpath(out)}
    return shlex.join(["unmodelled", "diagnose", *(f"{name}={value}" for name, value in words.items())])


def made_from(content: Mapping[str, Any]) -> str:
    """Return from which files an answer comes, and when it was made; empty where it does not say."""
    kept = content.get("sources")
    files = kept if isinstance(kept, dict) else {}
    names = [Path(str(files[name])).name for name in ("system", "logs") if files.get(name)]
    made = str(files.get("made", "")).replace("T", " ").replace("+00:00", " UTC")
    return ", ".join(filter(None, [" and ".join(names), made]))


def live_data(folder: Path, shown: Mapping[str, Any]) -> str:
    """Return tables/live.json as a data block, with the names of the page; empty where there is none."""
    path = folder / "tables" / "live.json"
    if not path.exists():
        return ""
    from unmodelled.report.figures.residual import is_undetermined  # matplotlib, which not every page needs
    from unmodelled.report.figures.tables import table

    content, about = read_json(path), shown["about"]
    units, windows = about["units"], table(folder, "windows") if content["effects"] else None
    for effect, entry in zip(content["effects"], shown["effects"], strict=True):
        effect["name"] = entry["name"]
        if windows is not None and entry["port"] in about["channels"]:
            every = windows[windows["channel"] == entry["port"]]
            if is_undetermined(about, entry["port"], every):
                effect["missing"] = None
        if effect["curve"] and "x_unit" not in effect["curve"]:  # of an answer of an older version
            effect["curve"]["x_unit"] = units.get(effect["curve"]["x"], "")
    return as_block(with_scales(content))


def with_scales(live: Mapping[str, Any]) -> dict[str, Any]:
    """Data of a machine, whose inputs are in SI, with factor and zero of the units that are shown."""
    inputs = []
    for item in live["inputs"]:
        logged = parse_logged(item["unit"])[1]
        scale = {} if logged is None else {"factor": logged.factor, "offset": logged.offset}
        inputs.append({**item, **scale})
    return {**live, "inputs": inputs}


def view(folder: Path) -> dict[str, Any]:
    """Return the values with which a template shows a diagnosis."""
    content, about = read_json(folder / "diagnosis.json"), read_json(folder / "tables" / "about.json")
    units = about["units"]
    effects = parameter_tables(content)
    regions = about.get("regions", content["where"]["regions"])
    where = where_tables({**content, "where": {**content["where"], "regions": regions}}, units)
    others = {
        "errors": units_table(content),
        "gap": gap_table(content),
        "experiments": experiments_table(content),
        "identified": identified_table(content, units),
        "comparison": comparison_table(content),
    }
    by_evidence = {"chain": chain_table, "evidence": evidence_table}
    others |= {name: build(content) for name, build in by_evidence.items() if content.get(name)}
    robot, gap = content.get("robot"), content["gap"]
    if robot:
        others["robot_changes"] = changes_table(robot)
        others["robot_replay"] = replay_table(robot, gap["held_out"], gap["horizon"])
    return {
        "content": content,
        "about": about,
        "headline": headline(content),
        "outcome": UNEXPLAINED if content["verdict"] == "unknown" else outcome(content),
        "looks": " ".join(left_looks_like(content)) if content["verdict"] == "unknown" else "",
        "ranking": rankings(content),
        "next": next_step(content).replace("in index.html", "on this page").replace(PAGE, "this page"),
        "offered": (folder / AUGMENTED).exists(),
        "augmented_file": AUGMENTED,
        "changes": _changes(folder / "tables" / CHANGES),
        "strangers": strangers_sentence(content["strangers"]) if content.get("strangers") else "",
        "remains": remains(content),
        "drawing": machine_drawing(content, about["machine"]) if "machine" in about else "",
        "faults": list(dict.fromkeys(row["sentence"] for row in content.get("logs", ()))),
        "summary": _summary(content),
        "searched": content["verdict"] != "check_logs",
        "effects": [_effect(e, t, about) for e, t in zip(content["effects"], effects, strict=True)],
        "where": where,
        **others,
        "refused": content.get("refused", ()),
        "robot": robot,
        "robot_says": robot_sentence(robot) if robot else "",
        "tables": [*effects, *where, *others.values()],
        "figures": {figure.id: figure for figure in read_figures(folder / "figures")},
        "origin": about["data"],
        "banner": ORIGINS[about["data"]] if about["data"] not in ("", "measured") else "",
        "made": made_from(content),
        "tiles": _tiles(content),
        "short": short,
        "amounts": amounts,
        "percent": percent,
        "place_name": place_name,
    }


def _summary(content: Mapping[str, Any]) -> str:
    if content["verdict"] == "check_logs":
        return (
            "No effect was searched or fitted, because it would explain the fault of the logs. Correct the "
            "logs or the system file, and run the diagnosis again."
        )
    held = "All errors are those of an experiment by a fit to the others; each is left out once."
    if content.get("chance") is not None and content["verdict"] != "no_gap":
        held += (
            " If nothing were missing, the best of all laws would lower the error as much with a probability "
            f"of {short(content['chance'])}."
        )
    return held


def _tiles(content: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Numbers of the answer with what they are: the error in units first."""
    gap, fitted = content["gap"], content["verdict"] != "check_logs"
    tiles = [(percent(content["confidence"]), "confidence in this verdict")]
    every = [(name, as_said(entry)) for name, entry in gap.get("units", {}).items()]
    for name, entry in [*fallen(content), *every][:1]:
        after = "with the effects" if content["effects"] else "with refitted parameters"
        models = {"known": "as given", **({"augmented": after} if fitted else {})}
        values = [entry[model] for model in models]
        texts = ["diverges" if v is None else amounts([v], entry["unit"])[0] for v in values]
        about = f"error of {name} after {amounts([gap['horizon']], 's')[0]}, {' and '.join(models.values())}"
        tiles.insert(0, (" → ".join(texts), about))
    if content["effects"]:
        low, high = map(percent, gap["interval"])
        ends = f", 95\u202f% interval {low} to {high}" if low != high else ""
        tiles.append((percent(gap["shrink"]), f"of the squared gap explained{ends}"))
    if gap["floor"] and fitted:
        times = number(float(f"{max(gap['augmented'] / gap['floor'], 1.0):.2g}"))
        tiles.append((f"{times} ×", "the error that sensor noise alone causes is left"))
    return tiles


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
        "kind_name": kind_name(effect) if effect.get("kind") else "",
        "kind_sentence": kind_sentence(effect) if effect.get("kind") else "",
        "equation": _equation(effect["law"], str(effect.get("parameter") or left.get(kind, name))),
        "table": table,
        "unsure": doubt(effect),
        "only_with": [effect_name(other) for other in effect.get("only_with", ())],
        "alike": [effect_name(other) for other in effect["indistinguishable"]],
    }


def _changes(file: Path) -> list[tuple[str, str]]:
    """Lines of a difference with what they are: added, removed, a place, or nothing of these."""
    if not file.exists():
        return []
    marks = {"+": "added", "-": "removed", "@": "place"}
    lines = file.read_text(encoding="utf-8").splitlines()[2:]
    found = [(marks.get(line[:1], ""), line) for line in lines[:MOST_LINES]]
    rest = len(lines) - len(found)
    return [*found, *([("place", f"... and {rest} lines more")] if rest else [])]


def _equation(law: str, left: str) -> str:
    """The law as formulas, or as it is written where it is too long for that."""
    law = law.rpartition(" = ")[2]  # of another value of a parameter
    try:
        return formula(law, left)
    except BadInput:
        return f"<code>{escape(f'{left} = {law}')}</code>"
