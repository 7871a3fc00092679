"""A small set of everything that a report is made from, and the report of it."""

import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from pipeline.stages.site import site

SVG = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 500.5 300">'
    '<rect width="500" height="300" fill="#fff"/><path d="M20 280L480 20" stroke="#0072b2" stroke-width="4"/>'
    '<text x="20" y="40">speed (rad/s)</text></svg>'
)
LEAF = {"value": 0.25, "unit": "V", "interval": [0.23, 0.28], "n": 10}
HEAD = {"data": "virtual", "profile": "quick", "revision": "abc1234"}
#: An effect of diagnosis.json.
FRICTION = {
    "family": "coulomb_friction",
    "port": "rail",
    "law": "F_c*sign(v)",
    "parameters": {"F_c": {"value": 22.4, "unit": "N", "interval": [22.1, 22.8]}},
    "confidence": 0.9,
    "shrink": 0.98,
    "interval": [0.97, 0.99],
    "indistinguishable": [{"family": "stribeck_friction", "port": "rail"}],
}
NUMBERS = ("3.3", "4.4", "5.4", "5.11", "6.20", "6.23", "6.24")
#: What may not widen a page: a word without a place to break.
LONG = "a_very_long_name_without_any_place_where_a_line_could_break_" * 3


def put(path: Path, content: Any) -> None:
    """Write text, or anything else as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content))


def claim(**changes: Any) -> dict[str, Any]:
    return {
        "id": "hybrids",
        "chapter": 6,
        "page": "section 6.5.2",
        "claim": "hybrids extrapolate better",
        "dissertation": "better",
        "ours": 0.25123,
        "interval": [0.23, 0.28],
        "unit": "V",
        "protocol": "ten repeats",
        "data": "virtual",
        "verdict": "holds",
    } | changes


def figure(number: str, **changes: Any) -> dict[str, Any]:
    return {
        "id": f"fig_{number.replace('.', '_')}",
        "number": number,
        "chapter": int(number[0]) if number[0].isdigit() else None,
        "caption": f"caption of {number}",
        "note": "note",
        "command": "python -m pipeline draw",
        "data": "virtual",
    } | changes


def formula(mathml: str) -> dict[str, Any]:
    return {"chapter": 6, "rows": [{"kind": "dynamics", "text": "v", "mathml": mathml}]}


def execution(stage: str, **changes: Any) -> dict[str, Any]:
    return {
        "stage": stage,
        "command": f"python -m pipeline {stage.partition('@')[0]} out=data/{stage}",
        "configuration": f"_target_: pipeline.stages.{stage.partition('@')[0]}\nseed: 0\n",
        "seed": 0,
        "seconds": 12.5,
        "finished": "2026-01-02T03:04:05+00:00",
        "revision": "abc1234",
        "machine": "Linux x86_64, 2 cores",
        "versions": {"python": "3.11.2", "torch": "2.13.0"},
    } | changes


def write_inputs(folder: Path) -> Path:
    """Claims, figures, tables and numbers of chapters 5 and 6, a campaign and a fit."""
    put(
        folder / "metrics" / "chapter6.json",
        {**HEAD, "protocol": "free run", "boundary": {"10%": {"f_h2": LEAF}}},
    )
    put(folder / "metrics" / "cam_labels.json", {**HEAD, "stall": {"value": 9, "unit": "runs", "n": 180}})
    put(
        folder / "bench" / "claims.json",
        [claim(), claim(id="none", chapter=5, page=98, ours=None, interval=None)],
    )
    put(folder / "tables" / "table_5_1.csv", "name,value\na,0.123456\nb,\n")
    put(folder / "tables" / "table_5_1.json", {"title": "Table 5.1", "caption": "cams", "chapter": 5})
    put(folder / "figures" / "figures.json", [figure(number) for number in NUMBERS])
    for number in NUMBERS:
        put(folder / "figures" / f"fig_{number.replace('.', '_')}.svg", SVG)
    put(
        folder / "raw" / "cam_follower" / "provenance.json",
        {"data": "virtual", "description": "virtual bench", "experiments": 180},
    )
    fit = {"folds": ["10%", "20%"], "repeats": 3, "seed": 0, "seconds": 1.5, "parameters": 1234}
    put(folder / "fits" / "cam_follower" / "f_h2" / "extrapolation" / "fit.json", fit)
    return folder


def diagnosis(system: str = "emps") -> dict[str, Any]:
    gap = {"known": 0.31, "reidentified": 0.18, "augmented": 0.012, "neural": 0.011, "floor": 6.27e-6}
    gap |= {"persistence": 0.4, "shrink": 0.98, "interval": [0.97, 0.99], "held_out": ["run2"]}
    errors = {"known": 0.014, "augmented": 2e-4, "known_whole_run": 0.21, "augmented_whole_run": None}
    gap |= {"horizon": 0.1, "units": {"q": {"unit": "m", **errors}}}
    runs = [{"id": f"run{k}", "known": 0.3 + k, "augmented": 0.02} for k in range(8)]
    tried = [
        {
            "effects": [{"family": LONG, "port": "rail"}] if k else [FRICTION],
            **{"score": 0.9 + 0.5 * k, "difference": 0.5 * k, "standard_error": 0.1 * k, "named": not k},
        }
        for k in range(8)
    ]
    return {
        "schema": "diagnosis/2",
        "system": system,
        "seed": 0,
        "verdict": "effect",
        "confidence": 0.94,
        "effects": [FRICTION],
        "where": {
            "channels": [{"port": "rail", "share": 0.96}],
            "regions": [{"signal": "v", "low": -0.02, "high": 0.02, "share": 0.61}],
            "factors": [],
            "experiments": runs,
        },
        "gap": gap,
        "parameters": {"M": {"known": 95.1, "identified": 94.9, "unit": "kg", "interval": [94.6, 95.3]}},
        "comparison": tried,
        "remainder": None,
        "logs": [],
        "notes": ["v was estimated from q"],
    }


def write_diagnosis(folder: Path, system: str = "emps") -> None:
    """What `diagnose` leaves, without its page."""
    put(folder / "diagnosis.json", diagnosis(system))
    channels = {"rail": {"symbol": "F_rail"}}
    put(folder / "tables" / "about.json", {"data": "measured", "units": {"v": "m/s"}, "channels": channels})
    names = ("gap", "lacking", "left_over", "experiments", "before_and_after", "candidates")
    shown = [figure(str(k), id=name, data="", chapter=None) for k, name in enumerate(names, 1)]
    put(folder / "figures" / "figures.json", shown)
    for name in names:
        put(folder / "figures" / f"{name}.svg", SVG)


def make(inputs: Path, out: Path) -> dict[str, str]:
    """Build; return the text of every page by its address."""
    folders = {name: inputs / name for name in ("metrics", "tables", "figures", "diagnoses", "executions")}
    files = {"claims": inputs, "provenance": inputs / "raw"}
    site(**folders, **files, runs=inputs / "fits", full=inputs / "full.csv", out=out)
    return {path.relative_to(out).as_posix(): path.read_text() for path in out.rglob("*.html")}


class Page(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.ids: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.addresses += [value for key in ("href", "src") if (value := given.get(key))]
        self.ids += [value for key, value in attrs if key == "id" and value]
