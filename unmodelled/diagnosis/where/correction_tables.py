"""Tables of corrections, window by window, beside the laws that were found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.effect_channels import channel_of
from unmodelled.diagnosis.where.where import SHOWN_CHANNEL_SHARE, Where
from unmodelled.effects.place import Place
from unmodelled.systems.model import System, symbol
from unmodelled.systems.numeric import numpy_system_function

#: Columns of the coordinates of a channel, in their order.
PORT, OTHER = ("level", "rate", "acceleration"), ("level", "rate")
#: Bins over which the variance that a coordinate explains is computed; points at which a law is listed.
VARIANCE_BINS, LAW_POINTS = 30, 120


def correction_table(diagnosis: Diagnosis, where: Where) -> pd.DataFrame:
    """Return a row for every window in which a correction of a channel is determined."""
    stages = {"lacking": where.lacking} | ({"left": where.left} if diagnosis.effects else {})
    names = shown_channels(diagnosis, where)
    parts = [
        _part(diagnosis, found, k).assign(stage=stage)
        for stage, found in stages.items()
        for k, place in enumerate(found.places)
        if place.channel in names
    ]
    return pd.concat(parts, ignore_index=True)


def shown_channels(diagnosis: Diagnosis, where: Where) -> list[str]:
    """Return the channels of the effects and those with a large share, or the first one if there are none."""
    model = diagnosis.reidentified
    effects = [channel_of(model, found.added.place) for found in diagnosis.effects]
    large = [row["port"] for row in where.channels if row["share"] >= SHOWN_CHANNEL_SHARE]
    every = [place.channel for place in where.lacking.places]
    return [name for name in dict.fromkeys([*effects, *large]) if name in every] or every[:1]


def main_coordinate(table: pd.DataFrame, name: str) -> str:
    """Return the coordinate that explains most of the law at a channel, or else of the correction."""
    rows = table[(table["channel"] == name) & (table["stage"] == "lacking")]
    y = rows["law"] if rows["law"].notna().any() else rows["value"]
    scores = {column: _explained(rows[column], y) for column in PORT if rows[column].notna().any()}
    return max(scores, key=lambda column: scores[column], default="t")


def law_table(diagnosis: Diagnosis, where: Where, table: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    """Return the laws that were found, along the main coordinates of channels."""
    parts = [pd.DataFrame(columns=["channel", "x", "low", "law", "high"])]
    coordinates = where.lacking.coordinates
    for place in where.lacking.places:
        rows = table[(table["channel"] == place.channel) & (table["stage"] == "lacking")]
        if place.channel in names and rows["law"].notna().any():
            column = main_coordinate(table, place.channel)
            about = about_channels(where.lacking, [place.channel])[place.channel]
            along = coordinates.samples(place).get(about[column]["name"])
            pairs = (rows[column], rows["law"]) if along is None else (along, _law(diagnosis, place))
            parts.append(_told(*map(np.asarray, pairs)).assign(channel=place.channel))
    return pd.concat([part for part in parts if len(part)] or parts, ignore_index=True)


def _told(x: Array, law: Array) -> pd.DataFrame:
    order = np.argsort(x, kind="stable")
    bins = np.arange(len(x)) * min(LAW_POINTS, len(x)) // len(x)
    groups = pd.DataFrame({"x": x[order], "law": law[order]}).groupby(bins)
    spread = groups["law"].quantile([0.1, 0.5, 0.9]).unstack()
    return spread.set_axis(["low", "law", "high"], axis=1).assign(x=groups["x"].median())


def about_channels(corrections: Corrections, names: list[str]) -> dict[str, Any]:
    """Return kind, unit, symbol of an effort, and name and unit of each coordinate, by channel."""
    coordinates = corrections.coordinates
    found = {}
    for place in corrections.places:
        if place.channel in names:
            axes = {
                column: {"name": each.name, "unit": each.unit}
                for column, each in zip(_columns(place, corrections), coordinates.of(place), strict=True)
            }
            unit = _unit(corrections.model.system, place)
            entry = {"kind": place.kind, "name": place.name, "unit": unit, **axes}
            if place.kind == "port":
                entry["symbol"] = corrections.model.system.port(place.name).effort
            found[place.channel] = entry
    return found


def _part(diagnosis: Diagnosis, corrections: Corrections, k: int) -> pd.DataFrame:
    place, recording = corrections.places[k], corrections.recording
    coordinates = corrections.coordinates
    columns = dict.fromkeys(PORT, np.full(len(recording.start), np.nan))
    found = zip(_columns(place, corrections), coordinates.of(place), strict=True)
    columns |= {column: each.values for column, each in found}
    ids = np.array(recording.logs.ids, object)
    middle = recording.start + recording.steps // 2
    return pd.DataFrame(
        {
            "channel": place.channel,
            "experiment": ids[recording.owner],
            "t": recording.logs.t[middle],
            "value": corrections.value[:, k],
            "error": corrections.error[:, k],
            **columns,
            "law": coordinates.mean(_law(diagnosis, place)),
        }
    )[corrections.seen[:, k]]


def _columns(place: Place, corrections: Corrections) -> Iterator[str]:
    """Names of the columns of a place's coordinates."""
    if place.kind != "port":
        yield from OTHER
        return
    port = corrections.model.system.port(place.name)
    found = len(corrections.coordinates.of(place))
    yield from PORT[(port.position is None) :][:found]


def _unit(system: System, place: Place) -> str:
    if place.kind == "port":
        return system.port(place.name).unit
    items = system.inputs if place.kind == "actuator" else system.outputs
    return next(item.unit for item in items if item.name == place.name)


def _law(diagnosis: Diagnosis, place: Place) -> Array:
    """Return the contribution of the diagnosed effects at a place, shape (samples,); nan without a law."""
    model = diagnosis.augmented
    system, logs = model.system, model.logs
    laws = [
        symbol(name) * regressor
        for found in diagnosis.effects
        if found.added.place.channel == place.channel
        for name, regressor in zip(found.added.amplitudes, found.added.regressors, strict=True)
    ]
    if not laws:
        return np.full(len(logs.t), np.nan)
    function = numpy_system_function(system, [sum(laws, sp.S.Zero)], efforts_zero=True)
    constants = logs.c[logs.owner]
    return function(logs.t, logs.x, logs.u, np.empty(0), np.array(system.values), constants)[:, 0]


def _explained(x: pd.Series, y: pd.Series) -> float:
    """Share of the variance of y between bins of x."""
    variance = float(np.var(y))
    if variance == 0.0:
        return 0.0
    bins = pd.qcut(x.rank(method="first"), min(VARIANCE_BINS, len(x)), labels=False)
    return 1.0 - float(((y - y.groupby(bins).transform("mean")) ** 2).mean()) / variance
