"""next.json, the tables and the sentences of a designed experiment."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtr

from unmodelled.design.criterion import Value
from unmodelled.design.design import Design
from unmodelled.design.rivals import HALF_INTERVAL
from unmodelled.design.runs import frame
from unmodelled.design.sensors import BestSensor
from unmodelled.systems.model import Input, Output

Array = NDArray[np.float64]

SCHEMA = "next/1"
#: Probability below which an experiment does not tell two models apart, and digits of a number.
TOLD, DIGITS = 0.75, 8


def content(design: Design) -> dict[str, Any]:
    """Return the content of next.json.

    It has: `named` and `alternatives`, models by label, the latter with `odds` of the proposed experiment,
    the chirp and the random one (probability that it tells the named model from this one: the normal
    distribution function at half of `distance`, in standard deviations); `sensor`, the further sensor that
    would help most, with `odds` by alternative (null without alternatives); `numbers` with half 95 %
    intervals before and after each experiment; `shows`, lowest, highest and last output by model; null for a
    reference that keeps no limits at any amplitude.

    Args:
        design: designed experiment.
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
        "start": {s.name: criterion.limits.start.get(s.name, 0.0) for s in design.system.states},
        "operating_point": dict(criterion.limits.constants),
        "named": named.label,
        "alternatives": [
            {
                "label": other.label,
                "effect": dict(entry),
                "distance": float(design.value.distances[0, k]),
                "odds": {name: _odds(value, k) for name, value in values.items()},
            }
            for k, (other, entry) in enumerate(zip(others, design.alternatives, strict=True))
        ],
        "sensor": _sensor(design.sensor),
        "numbers": {name: _number(design, values, name) for name in criterion.numbers},
        "shows": {label: _shows(design, y) for label, y in design.predictions.items()},
    }
    return {name: rounded(value) for name, value in found.items()}


def experiment(design: Design) -> pd.DataFrame:
    """Return the experiment: t (s), and every input in the unit of its column in the logs.

    Args:
        design: designed experiment.
    """
    return frame(design.found.u, design.system, design.criterion.limits)


def predictions(design: Design) -> pd.DataFrame:
    """Return inputs and predicted outputs, a row per sample: kind, signal, unit, label, t, value (SI).

    Args:
        design: designed experiment. An input has no label; an output has the label of the model.
    """
    t = design.criterion.limits.period * np.arange(len(design.found.u))
    parts: list[tuple[str, Input | Output, str, Array]] = [
        ("input", i, "", design.found.u[:, k]) for k, i in enumerate(design.system.inputs)
    ]
    parts += [
        ("output", o, label, y[:, k])
        for label, y in design.predictions.items()
        for k, o in enumerate(design.system.outputs)
    ]
    rows = [
        pd.DataFrame({"kind": kind, "signal": i.name, "unit": i.unit, "label": label, "t": t, "value": value})
        for kind, i, label, value in parts
    ]
    return pd.concat(rows, ignore_index=True)


def sentences(found: Mapping[str, Any]) -> list[str]:
    """Return what a user reads of next.json.

    Args:
        found: content of next.json.
    """
    start = ", ".join(f"{name} = {value:g}" for name, value in found["start"].items())
    what = f"this {found['duration']:g} s experiment ({found['family']}, start at {start})"
    return [
        *_told(found, what),
        *_sensed(found),
        *_measured(found, what),
        "log it, add the log to the folder and diagnose again",
    ]


def _told(found: Mapping[str, Any], what: str) -> Iterator[str]:
    for each in found["alternatives"]:
        odds = each["odds"]
        beside = f"chirp: {_percent(odds['chirp'])}, random levels: {_percent(odds['random'])}"
        pair = f"{found['named']} from {each['label']}"
        if odds["proposed"] >= TOLD:
            yield f"{what} tells {pair} with {_percent(odds['proposed'])} ({beside})"
        else:
            yield (
                f"no experiment within the limits was found that tells {pair}: {_percent(odds['proposed'])} "
                f"({beside}; 50 % is chance); widen the limits, lengthen it or add a sensor"
            )


def _sensed(found: Mapping[str, Any]) -> Iterator[str]:
    """The sensor, where it adds a percent to the lowest odds."""
    sensor = found.get("sensor")
    least = min((each["odds"]["proposed"] for each in found["alternatives"]), default=1.0)
    if sensor and min(sensor["odds"]) > least + 0.01:
        yield (
            f"a sensor of {sensor['label']} as accurate as the others ({100.0 * sensor['accuracy']:.2g} % of "
            "its standard deviation in the experiment) would raise the lowest odds from "
            f"{_percent(least)} to {_percent(min(sensor['odds']))}"
        )


def _measured(found: Mapping[str, Any], what: str) -> Iterator[str]:
    for name, each in found["numbers"].items() if found["criterion"] == "intervals" else ():
        after, unit = each["after"], f" {each['unit']}".rstrip()
        yield (
            f"{what} narrows the 95 % interval of {name} = {each['value']:.4g}{unit} from "
            f"± {each['before']:.2g} to ± {after['proposed']:.2g} (chirp: {_half(after['chirp'])}, "
            f"random levels: {_half(after['random'])})"
        )


def _percent(odds: float | None) -> str:
    return "not within the limits" if odds is None else f"{min(100.0 * odds, 99.9):.3g} %"


def _half(width: float | None) -> str:
    return "not within the limits" if width is None else f"± {width:.2g}"


def _sensor(found: BestSensor | None) -> dict[str, Any] | None:
    if found is None:
        return None
    odds = [float(ndtr(0.5 * distance)) for distance in found.distances]
    about = {"label": found.sensor.label, "unit": found.sensor.unit, "accuracy": found.accuracy}
    return {**about, "odds": odds}


def _odds(value: Value | None, alternative: int) -> float | None:
    return None if value is None else float(ndtr(0.5 * value.distances[0, alternative]))


def _number(design: Design, values: Mapping[str, Value | None], name: str) -> dict[str, Any]:
    criterion, named = design.criterion, design.criterion.rivals[0]
    row = list(named.values).index(name)
    units = {p.name: p.unit for p in named.fitted.hypothesis.system.parameters}
    units |= {n: unit for e in named.fitted.hypothesis.effects for n, unit in e.units.items()}
    return {
        "value": named.values[name],
        "unit": units[name],
        "before": HALF_INTERVAL * float(criterion.before[row]),
        "after": {
            key: None if value is None else HALF_INTERVAL * float(value.after[0, row])
            for key, value in values.items()
        },
    }


def _shows(design: Design, y: Array) -> dict[str, Any]:
    return {
        output.name: {
            "unit": output.unit,
            "lowest": float(y[:, k].min()),
            "highest": float(y[:, k].max()),
            "last": float(y[-1, k]),
        }
        for k, output in enumerate(design.system.outputs)
    }


def rounded(value: Any) -> Any:
    """Return a value with few enough digits that equal runs on two machines give equal files.

    Args:
        value: mapping, list, number or text; a number that is not finite becomes None.
    """
    match value:
        case Mapping():
            return {str(key): rounded(item) for key, item in value.items()}
        case list():
            return [rounded(item) for item in value]
        case float():
            return float(f"{value:.{DIGITS}g}") + 0.0 if math.isfinite(value) else None
        case _:
            return value
