"""Numbers and tables of the diagnoses of measured machines, by what their known physics withholds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.chapters.reported import read_told
from unmodelled.base.errors import BadInput

Report = Mapping[str, Any]
Diagnoses = dict[str, dict[str, Report]]

#: Of system files and folders; what stands before it is what the known physics withholds.
SUFFIX = "_withheld"
GAPS = ("known", "reidentified", "augmented", "neural", "floor")
PROTOCOL = (
    "gap: free runs from the measured states on held-out experiments, in standard deviations of the outputs; "
    "shrink: the share of the re-identified square gap above the floor that the named effects explain, with "
    "its 95 % interval over experiments; remainder: the gap that is left with them over the floor, what the "
    "noise of the sensors leaves"
)


def read_diagnoses(folder: Path) -> Diagnoses:
    """Read <machine>/<what>_withheld/diagnosis.json, by machine and by what is withheld.

    Args:
        folder: folder of all diagnoses.

    Raises:
        BadInput: when there is no diagnosis, or a file is no diagnosis.
    """
    found: Diagnoses = {}
    for path in sorted(folder.glob(f"[!.]*/[!.]*{SUFFIX}/diagnosis.json")):
        content = read_told(path)
        if content["gap"]["floor"] <= 0.0 or len(content["gap"]["interval"]) != 2:
            raise BadInput(f"{path}: gap: floor must be positive, interval two numbers")
        withheld = path.parent.name.removesuffix(SUFFIX)
        found.setdefault(path.parents[1].name, {})[withheld] = content
    if not found:
        raise BadInput(f"{folder}: no */*{SUFFIX}/diagnosis.json")
    return found


def leaves(report: Report) -> dict[str, Any]:
    """Return the numbers of one diagnosis.

    Args:
        report: content of diagnosis.json.
    """
    gap = report["gap"]
    n = len(gap["held_out"])
    return {
        "verdict": {"value": report["verdict"], "n": n},
        "effects": {"value": "; ".join(_effect(e) for e in report["effects"]) or "none", "n": n},
        "confidence": {"value": report["confidence"], "unit": "1"},
        "shrink": {"value": gap["shrink"], "unit": "1", "n": n, **_limits(gap["interval"])},
        "remainder": {"value": gap["augmented"] / gap["floor"], "unit": "floors", "n": n},
        "gap": {
            kind: {"value": gap[kind], "unit": "standard deviations", "n": n}
            for kind in GAPS
            if gap[kind] is not None
        },
    }


def _limits(interval: Sequence[float | None]) -> dict[str, Any]:
    return {} if None in interval else {"interval": list(interval)}


def verdicts(reports: Mapping[str, Report]) -> pd.DataFrame:
    """Return one row per withheld effect of one machine.

    Args:
        reports: content of diagnosis.json, by what the known physics withholds.
    """
    rows = []
    for withheld, report in reports.items():
        gap, effects = report["gap"], report["effects"]
        alike = sorted({_named(other) for e in effects for other in e["indistinguishable"]})
        rows.append(
            {
                "withheld": withheld,
                "verdict": report["verdict"],
                "confidence": report["confidence"],
                "effects": "; ".join(_effect(e) for e in effects),
                "not told apart from": "; ".join(alike),
                **{kind: gap[kind] for kind in GAPS},
                "shrink": gap["shrink"],
                "shrink low": gap["interval"][0],
                "shrink high": gap["interval"][1],
                "remainder / floor": gap["augmented"] / gap["floor"],
            }
        )
    return pd.DataFrame(rows)


def numbers(reports: Mapping[str, Report]) -> pd.DataFrame:
    """Return the identified parameters of the known physics and of the effects.

    Args:
        reports: content of diagnosis.json, by what the known physics withholds.
    """
    rows = []
    for withheld, report in reports.items():
        own = {name: ("known physics", values) for name, values in report["parameters"].items()}
        added = {
            name: (_named(e), {**values, "identified": values["value"]})
            for e in report["effects"]
            for name, values in e["parameters"].items()
        }
        for name, (owner, values) in {**own, **added}.items():
            low, high = values["interval"] or (None, None)
            rows.append(
                {
                    "withheld": withheld,
                    "of": owner,
                    "parameter": name,
                    "unit": values.get("unit", ""),
                    "given": values.get("known"),
                    "identified": values["identified"],
                    "low": low,
                    "high": high,
                }
            )
    return pd.DataFrame(rows)


def left_over(reports: Mapping[str, Report]) -> pd.DataFrame:
    """Return the location of the gap, the remaining gap of every experiment with the named effects, and the
    notes.

    Args:
        reports: content of diagnosis.json, by what the known physics withholds.
    """
    rows = [
        {"withheld": withheld, "kind": kind, "where": where, "share": share, "left": left}
        for withheld, report in reports.items()
        for kind, where, share, left in _places(report)
    ]
    return pd.DataFrame(rows)


def _places(report: Report) -> Iterator[tuple[str, str, float | None, float | None]]:
    where = report["where"]
    for c in where["channels"]:
        yield "channel", c["port"], c["share"], None
    for r in where["regions"]:
        yield "region", f"{r['signal']} from {r['low']:.3g} to {r['high']:.3g}", r["share"], None
    for f in where["factors"]:
        level = f["level"] if isinstance(f["level"], str) else f"{f['level']:.4g}"
        yield "factor", f"{f['factor']} = {level}", f["share"], None
    for e in where["experiments"]:
        yield "experiment", e["id"], None, e["augmented"]
    for note in report["notes"]:
        yield "note", note, None, None


def _named(effect: Mapping[str, Any]) -> str:
    place = effect.get("port")
    return f"{effect['family']} at {place}" if place else str(effect["family"])


def _effect(effect: Mapping[str, Any]) -> str:
    level = f" where {effect['factor']} = {effect['level']}" if "factor" in effect else ""
    partial = " (partial)" if effect.get("partial") else ""
    return f"{_named(effect)}: {effect['law']}{level}{partial}"
