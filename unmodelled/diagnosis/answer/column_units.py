"""Tables of figures and of the page in the units of the logs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from unmodelled.effects.telling import unit_of
from unmodelled.systems.model import Input, Output, System
from unmodelled.systems.units import LoggedUnit

#: Columns of the tables of corrections and of laws that have the unit of the channel.
VALUES = ("value", "error", "low", "law", "high")
_RATE = re.compile(r"d\((\w+)\)/dt")


def axis_unit(system: System, name: str) -> LoggedUnit | None:
    """Return the unit in which a person reads a coordinate, or None if no column shows it."""
    if (rate := _RATE.fullmatch(name)) is None:
        return unit_of(system, name, level=True)
    found = unit_of(system, rate[1], level=False)
    slash = found is not None and ("/" in found.text or " " in found.text)
    text = "" if found is None else f"({found.text})/s" if slash else f"{found.text}/s"
    return found and LoggedUnit(text, found.factor, 0.0)


def channels_in_columns(system: System, channels: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is said of channels, see `about_channels`, with the units of the logs."""
    return {name: _channel(system, about) for name, about in channels.items()}


def _channel(system: System, about: Mapping[str, Any]) -> dict[str, Any]:
    found = dict(about)
    if (own := _own(system, about)) is not None:
        found["unit"] = own.text
    for column, axis in _axes(about).items():
        if (unit := axis_unit(system, axis["name"])) is not None:
            found[column] = {**axis, "unit": unit.text}
    return found


def table_in_columns(
    system: System, channels: Mapping[str, Any], table: pd.DataFrame, along: Mapping[str, str] | None = None
) -> pd.DataFrame:
    """Return a table of corrections, or of laws, in SI with its values in the units of the logs."""
    found = table.copy()
    for name, about in channels.items():
        rows = found["channel"] == name
        axes = {column: axis["name"] for column, axis in _axes(about).items()}
        columns = axes if along is None else {"x": axes.get(along[name], "")}
        scales = {column: axis_unit(system, axis) for column, axis in columns.items()}
        scales |= dict.fromkeys(VALUES, _own(system, about))
        for column, unit in scales.items():
            if unit is not None and column in found:
                found.loc[rows, column] = unit.from_si(found.loc[rows, column].to_numpy(float))
    return found


def regions_in_columns(system: System, regions: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return regions, in SI, with their ends in the units of the logs."""
    found = []
    for row in regions:
        unit = axis_unit(system, str(row["signal"])) or LoggedUnit("", 1.0, 0.0)
        ends = {end: (row[end] - unit.offset) / unit.factor for end in ("low", "high")}
        found.append({**row, **ends})
    return found


def _axes(about: Mapping[str, Any]) -> dict[str, Any]:
    return {key: axis for key, axis in about.items() if isinstance(axis, dict)}


def _own(system: System, about: Mapping[str, Any]) -> LoggedUnit | None:
    """Unit of a correction of an input or output; the effort of a port stays in SI."""
    kind, name = about["kind"], about["name"]
    items: tuple[Input | Output, ...] = ()
    if kind in ("actuator", "sensor"):
        items = system.inputs if kind == "actuator" else system.outputs
    return next((item.as_difference for item in items if item.name == name), None)
