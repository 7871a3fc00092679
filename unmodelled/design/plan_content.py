"""plan.json, the table and the sentences of planned experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from unmodelled.base.wording import amounts, effect_name
from unmodelled.design.content import conditions, kept, rounded
from unmodelled.design.limits import Limits
from unmodelled.design.planned import Inputs
from unmodelled.design.visible import ALIKE_FROM, Alike, Visible
from unmodelled.effects.telling import said, scale
from unmodelled.systems.model import System

SCHEMA = "plan/2"


def plan_content(
    system: System,
    limits: Limits,
    inputs: Inputs,
    found: Sequence[Visible],
    pairs: Sequence[Alike],
    seed: int,
) -> dict[str, Any]:
    """Return the content of plan.json.

    It has: `noise`, `inputs` (limits), `start` and `operating_point`, in the units of the system file, which
    stand beside the values; `experiments` with durations (s); `refitted`, the parameters that are re-fitted;
    `effects` with `size`, the smallest size of `number` that shows with 95 % (null: no plausible size shows),
    `share` of the plausible size (null where the effect is not in proportion to a size), and `alike`: effects
    that would look like it, with the correlation and the size from which both are told apart (null: none).
    """
    content = {
        "schema": SCHEMA,
        "system": system.name,
        "seed": seed,
        "period": limits.period,
        "noise": {
            o.name: {"value": limits.noise[o.name] / o.as_written.factor, "unit": o.column_unit}
            for o in system.outputs
        },
        **conditions(system, limits, next(iter(inputs.values()))[0]),
        "experiments": [{"id": name, "duration": limits.period * (len(u) - 1)} for name, u in inputs.items()],
        "refitted": list(system.uncertain),
        "effects": [_effect(one, pairs) for one in found],
    }
    return {name: rounded(value) for name, value in content.items()}


def _effect(one: Visible, pairs: Sequence[Alike]) -> dict[str, Any]:
    both = [(p, p.other if p.one is one else p.one) for p in pairs if one in (p.one, p.other)]
    return {
        **_named(one),
        "number": one.number,
        "unit": one.added.units[one.number],
        "size": one.size,
        "share": one.share,
        **_shown(one),
        "alike": [
            {
                **_named(other),
                "correlation": pair.likeness,
                "told_apart": pair.told if pair.one is one else None,
            }
            for pair, other in both
        ],
    }


def _shown(one: Visible) -> dict[str, Any]:
    """The size as a person says it in the units of the logs, where that is another number.

    Of a wrong number it is the size of the error, not the right value.
    """
    if one.size is None or one.added.is_other_value or scale(one.added, one.number) is None:
        return {}
    number = said(one.added, one.number, (one.size,))
    about = {"symbol": number.symbol, "words": number.words, "unit": number.unit}
    return {"shown": {**about, "size": number.values[0]}}


def _named(one: Visible) -> dict[str, Any]:
    named = {"family": one.added.family, "port": one.added.place.channel}
    return {**named, "label": effect_name(named)}


def effects_table(content: Mapping[str, Any]) -> pd.DataFrame:
    """Return a row per effect: effect, number, size and unit, share, looks_like.

    A size is said as in the answer of a diagnosis, in the units of the logs.
    """
    rows = [
        {
            "effect": entry["label"],
            "number": entry.get("shown", {}).get("symbol", entry["number"]),
            "size": entry.get("shown", entry)["size"],
            "unit": entry.get("shown", entry)["unit"],
            "share": entry["share"],
            "looks_like": "; ".join(other["label"] for other in entry["alike"]),
        }
        for entry in content["effects"]
    ]
    return pd.DataFrame(rows).astype({"size": float, "share": float})


def plan_lines(content: Mapping[str, Any]) -> list[str]:
    """Return what a user reads of plan.json: a table of the effects, and what its columns mean."""
    rows = [("effect", "shows from", "looks like")]
    rows += [
        (entry["label"], _size(entry), ", ".join(_short(other, entry) for other in entry["alike"]))
        for entry in content["effects"]
    ]
    widths = [max(len(row[k]) for row in rows) for k in range(2)]
    total = sum(each["duration"] for each in content["experiments"])
    again = f", {', '.join(content['refitted'])} re-fitted" if content["refitted"] else ""
    return [
        f"{len(content['experiments'])} experiments, {total:.4g} s in all{again}; limits: {kept(content)}",
        *(f"{a:<{widths[0]}}  {b:<{widths[1]}}  {c}".rstrip() for a, b, c in rows),
        "shows from: smallest size that is told from none with 95 %, and its share of a plausible size",
        "looks like: after re-fitting, the outputs change in nearly the same way "
        f"(correlation above {ALIKE_FROM:.2g})",
        *(f"note: {note}" for note in content["notes"]),
    ]


def _size(entry: Mapping[str, Any]) -> str:
    if entry["size"] is None:
        return "does not show"
    told = {"symbol": entry["number"], "words": "", **entry, **entry.get("shown", {})}
    (size,) = amounts([told["size"]], told["unit"])
    share, words = entry["share"], told["words"] and f", {told['words']}"
    if share is None:
        return f"{told['symbol']} = {size}{words}"
    return f"{size}{words} ({100.0 * share:.2g}\u202f%)"


def _short(other: Mapping[str, Any], entry: Mapping[str, Any]) -> str:
    """Name of an effect, without its place where that is the same."""
    place = effect_name(entry).partition(" at ")[2]
    return str(other["label"]).removesuffix(f" at {place}")
