"""next.json, the tables and the sentences of a designed experiment."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.base.wording import number, unit_text
from unmodelled.design.criterion import GAIN, BestSensor, Value, odds
from unmodelled.design.design import Design
from unmodelled.design.draws import DRAWS
from unmodelled.design.limits import Limits, units_of
from unmodelled.design.rivals import HALF_INTERVAL
from unmodelled.design.runs import shown_start
from unmodelled.design.written import frame
from unmodelled.effects.added import Added
from unmodelled.effects.telling import scale
from unmodelled.logs.logs import as_logged
from unmodelled.systems.model import Input, Output, System
from unmodelled.systems.units import LoggedUnit

SCHEMA = "next/3"
#: Probability below which an experiment does not tell two models apart, and digits of a number.
TOLD, DIGITS = 0.75, 8


def content(design: Design) -> dict[str, Any]:
    """Return the content of next.json.

    It has: `named` and `alternatives`, models by label, the latter with `odds` of the proposed
    experiment, the chirp and the random one (probability that it tells the named model from this one: the
    normal distribution function at half of `distance`, in standard deviations); `sensor`, the further
    sensor that would help most, with `odds` by alternative (null without alternatives); `numbers` with
    half 95 % intervals before and after each experiment; `shows`, lowest, highest and last output by
    model; null for a reference that keeps no limits at any amplitude. `odds` and `after` are means over
    `draws` sets of numbers from the intervals of the answer, `worst` those of the worst draw. `start`,
    `operating_point`, `inputs` and `travel` (the limits that the experiment keeps, `travel` with the ends
    that any model reaches at any draw), `shows`, and `shown` of a number are in the units of the system
    file, which stand beside the values.
    """
    criterion = design.criterion
    values = {"proposed": design.value, **design.compared}
    named, *others = criterion.rivals
    found = {
        "schema": SCHEMA,
        "system": design.system.name,
        "seed": design.seed,
        "duration": criterion.limits.duration,
        "period": criterion.limits.period,
        "family": design.found.family.name,
        "criterion": "distance" if others else "intervals",
        **conditions(design.system, criterion.limits, design.found.u[0]),
        "travel": _travel(design),
        "draws": DRAWS,
        "named": named.label,
        "alternatives": [
            {
                "label": other.label,
                "effect": dict(entry),
                "distance": float(design.value.distance[k]),
                "odds": {n: v and float(v.odds[:, k].mean()) for n, v in values.items()},
                "worst": {n: v and float(v.odds[:, k].min()) for n, v in values.items()},
            }
            for k, (other, entry) in enumerate(zip(others, design.alternatives, strict=True))
        ],
        "sensor": _sensor(design.sensor),
        "numbers": {name: _number(design, values, name) for name in criterion.numbers},
        "shows": {label: _shows(design, y) for label, y in design.predictions.items()},
        "notes": list(design.notes),
    }
    return {name: rounded(value) for name, value in found.items()}


def conditions(system: System, limits: Limits, u: Array) -> dict[str, Any]:
    """Return the limits of the inputs and the start of an experiment, in the units of the system file.

    Takes u (inputs,) in SI.
    """
    units = units_of(system)
    inputs = zip(system.inputs, limits.written, strict=True)
    start = shown_start(system, limits, u)
    constants = {item.name: (limits.constants[item.name], item.as_written) for item in system.operating_point}
    return {
        "inputs": {
            item.name: {"low": own.low, "high": own.high, "rate": own.rate, "unit": item.column_unit}
            for item, own in inputs
        },
        "start": {name: _amount(value, units[name]) for name, value in start.items()},
        "operating_point": {name: _amount(*pair) for name, pair in constants.items()},
    }


def kept(found: Mapping[str, Any]) -> str:
    """Return the limits of inputs and travel in words.

    Examples:
        >>> kept({"inputs": {"i": {"low": -800.0, "high": 800.0, "rate": None, "unit": "mA"}}})
        'i −800 to 800 mA'
    """
    ranges = []
    for name, own in {**found["inputs"], **found.get("travel", {})}.items():
        unit = unit_text(own["unit"])
        rate = "" if own["rate"] is None else f"at most {number(own['rate'])} {unit}/s"
        low, high = ("" if own[end] is None else number(own[end]) for end in ("low", "high"))
        span = f"{low} to {high}" if low and high else f"from {low}" if low else f"up to {high}"
        parts = [f"{span} {unit}".rstrip() if low or high else "", rate]
        ranges.append(f"{name} {', '.join(filter(None, parts))}")
    return "; ".join(ranges)


def experiment(design: Design) -> pd.DataFrame:
    """Return the experiment: its clock and every input in the units of the logs."""
    return frame(design.found.u, design.system, design.criterion.limits)


def predictions(design: Design) -> pd.DataFrame:
    """Return inputs and predicted outputs, a row per sample: kind, signal, unit, label, t, value.

    Beside the kinds input and output, lowest and highest are the ends of the predictions of all draws.
    """
    t = design.criterion.limits.period * np.arange(len(design.found.u))
    parts: list[tuple[str, Input | Output, str, Array]] = [
        ("input", i, "", design.found.u[:, k]) for k, i in enumerate(design.system.inputs)
    ]
    parts += [
        (kind, o, label, value[:, k])
        for label, y in design.predicted.items()
        for kind, value in (("output", y[0]), ("lowest", y.min(axis=0)), ("highest", y.max(axis=0)))
        for k, o in enumerate(design.system.outputs)
    ]
    rows = [
        pd.DataFrame(
            {"kind": kind, "signal": i.name, "unit": i.column_unit, "label": label, "t": t}
            | {"value": as_logged(i, value)}
        )
        for kind, i, label, value in parts
    ]
    return pd.concat(rows, ignore_index=True)


def drawn_limits(found: Mapping[str, Any]) -> dict[tuple[str, str], tuple[float | None, float | None]]:
    """Return the ends of the range of every input, and of every output with a travel limit, by its kind."""
    kinds = {"input": found["inputs"], "output": found["travel"]}
    return {(kind, n): (own["low"], own["high"]) for kind, each in kinds.items() for n, own in each.items()}


def sentences(found: Mapping[str, Any]) -> list[str]:
    """Return what a user reads of next.json."""
    amounts = {name: f"{each['value']:g} {unit_text(each['unit'])}" for name, each in found["start"].items()}
    start = ", ".join(f"{name} = {amount.rstrip()}" for name, amount in amounts.items())
    what = f"this {found['duration']:g} s experiment ({found['family']}{start and f', start at {start}'})"
    return [
        *_told(found, what),
        *_sensed(found),
        *_measured(found, what),
        f"limits that it keeps: {kept(found)}",
        *(f"note: {note}" for note in found["notes"]),
        "log it, add the log to the folder and diagnose again",
    ]


def _told(found: Mapping[str, Any], what: str) -> Iterator[str]:
    for each in found["alternatives"]:
        odds, worst = each["odds"], each["worst"]
        beside = (
            f"at worst {_percent(worst['proposed'])}; chirp: {_percent(odds['chirp'])}, random levels: "
            f"{_percent(odds['random'])}"
        )
        pair = f"{found['named']} from {each['label']}"
        if odds["proposed"] >= TOLD:
            yield f"{what} tells {pair} with {_percent(odds['proposed'])} ({beside})"
        else:
            yield (
                f"no experiment within the limits was found that tells {pair}: {_percent(odds['proposed'])} "
                f"({beside}; 50 % is chance); widen the limits, lengthen it or add a sensor"
            )


def _sensed(found: Mapping[str, Any]) -> Iterator[str]:
    """The sensor, where it adds to the lowest odds."""
    sensor = found.get("sensor")
    least = min((each["odds"]["proposed"] for each in found["alternatives"]), default=1.0)
    if sensor and min(sensor["odds"]) > least + GAIN:
        yield (
            f"a sensor of {sensor['label']} as accurate as the others ({100.0 * sensor['accuracy']:.2g} % of "
            "its standard deviation in the experiment) would raise the lowest odds from "
            f"{_percent(least)} to {_percent(min(sensor['odds']))}"
        )


def _measured(found: Mapping[str, Any], what: str) -> Iterator[str]:
    for name, own in found["numbers"].items() if found["criterion"] == "intervals" else ():
        each = {"symbol": name, **own, **own.get("shown", {})}
        after, unit = each["after"], f" {each['unit']}".rstrip()
        before, proposed = f"± {each['before']:.2g}", f"± {after['proposed']:.2g}"
        beside = (
            f"at worst ± {each['worst']['proposed']:.2g}; chirp: {_half(after['chirp'])}, random levels: "
            f"{_half(after['random'])}"
        )
        interval = f"the 95 % interval of {each['symbol']} = {each['value']:.4g}{unit}"
        if proposed != before:
            yield f"{what} narrows {interval} from {before} to {proposed} ({beside})"
        else:
            yield (
                f"no experiment within the limits was found that narrows {interval}, {before} ({beside}); "
                "widen the limits, lengthen it or add a sensor"
            )


def _amount(value: float, unit: LoggedUnit) -> dict[str, Any]:
    """A value in SI as a value with its unit."""
    return {"value": float(unit.from_si(np.asarray(value))), "unit": unit.text}


def _percent(odds: float | None) -> str:
    return "not within the limits" if odds is None else f"{min(100.0 * odds, 99.9):.3g} %"


def _half(width: float | None) -> str:
    return "not within the limits" if width is None else f"± {width:.2g}"


def _sensor(found: BestSensor | None) -> dict[str, Any] | None:
    if found is None:
        return None
    about = {"label": found.sensor.label, "unit": found.sensor.unit, "accuracy": found.accuracy}
    return {**about, "odds": odds(found.distances).tolist()}


def _travel(design: Design) -> dict[str, Any]:
    """Limits of the travel, and the ends that any model reaches at any draw of its numbers."""
    limits, units = design.criterion.limits, units_of(design.system)
    found: dict[str, Any] = {}
    for name, column in (pair for watched in design.watched for pair in limits.columns(watched)):
        own, x = limits.moves[name], units[name].from_si(column)
        lowest, highest = found[name]["reached"] if name in found else (np.inf, -np.inf)
        reached = [float(min(lowest, x.min())), float(max(highest, x.max()))]
        ends = {"low": own.low, "high": own.high, "rate": own.rate}
        found[name] = {**ends, "unit": units[name].text, "reached": reached}
    return found


def _number(design: Design, values: Mapping[str, Value | None], name: str) -> dict[str, Any]:
    criterion, named = design.criterion, design.criterion.rivals[0]
    row = list(named.values).index(name)
    hypothesis = named.fitted.hypothesis
    units = {p.name: p.unit for p in hypothesis.system.parameters}
    units |= {n: unit for e in hypothesis.effects for n, unit in e.units.items()}
    found = {
        "value": named.values[name],
        "unit": units[name],
        "before": HALF_INTERVAL * float(criterion.before[row]),
        "after": {n: v and HALF_INTERVAL * float(v.after[:, row].mean()) for n, v in values.items()},
        "worst": {n: v and HALF_INTERVAL * float(v.after[:, row].max()) for n, v in values.items()},
    }
    effect = next((e for e in hypothesis.effects if name in e.units), None)
    return found if effect is None else {**found, **_shown(effect, name, found)}


def _shown(effect: Added, name: str, found: Mapping[str, Any]) -> dict[str, Any]:
    """The number as a person says it in the units of the logs, where that is another one."""
    if (said := scale(effect, name)) is None:
        return {}
    symbol, unit, slope, shift = said
    both = {
        key: {n: None if width is None else abs(slope) * width for n, width in found[key].items()}
        for key in ("after", "worst")
    }
    about = {"symbol": symbol, "unit": unit, "value": slope * found["value"] + shift}
    return {"shown": {**about, "before": abs(slope) * found["before"], **both}}


def _shows(design: Design, y: Array) -> dict[str, Any]:
    found = {}
    for k, output in enumerate(design.system.outputs):
        shown = as_logged(output, y[:, k])
        ends = {"lowest": float(shown.min()), "highest": float(shown.max()), "last": float(shown[-1])}
        found[output.name] = {"unit": output.column_unit, **ends}
    return found


def rounded(value: Any) -> Any:
    """Return a value with few enough digits that equal runs on two machines give equal files."""
    match value:
        case Mapping():
            return {str(key): rounded(item) for key, item in value.items()}
        case list():
            return [rounded(item) for item in value]
        case float():
            return float(f"{value:.{DIGITS}g}") + 0.0 if math.isfinite(value) else None
        case _:
            return value
