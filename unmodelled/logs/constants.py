"""Constants of an experiment that the system file gives, and not the log folder."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.systems.model import Constant, System

#: What stands between the id of a log and the number of its part.
PART = ".part"


def logged(system: System) -> list[str]:
    """Return the names of the constants that are columns of experiments.csv."""
    return [constant.name for constant in system.operating_point if constant.values is None]


def part_name(record: str, number: int) -> str:
    """Return the id of a part of a log that was cut at its gaps."""
    return f"{record}{PART}{number}"


def with_constants(
    system: System, experiments: pd.DataFrame, places: Sequence[str]
) -> tuple[pd.DataFrame, list[str]]:
    """Return the table of experiments with a column for every constant that the system file gives.

    The column takes the place of a column of that name. A part of a log that was cut at its gaps has the
    value of the log, unless it has one of its own.
    """
    columns, notes = {}, []
    for constant in system.operating_point:
        if constant.values is None:
            continue
        columns[constant.name] = [constant.value(_listed(constant, name)) for name in experiments["id"]]
        for name, place, value in zip(experiments["id"], places, columns[constant.name], strict=True):
            if value is None:
                raise BadInput(
                    f"{place}: the experiment {name!r} is not in operating_point.{constant.name}.values of "
                    f"the system {system.name}, which has no other value"
                )
        others = [name for name in experiments["id"] if not is_given(constant, name)]
        if others:
            until = " until their own is fitted" if constant.identify else ""
            notes.append(
                f"{constant.name}: {len(others)} of {len(experiments)} experiments, {others[0]} among them, "
                f"are not in the system file and have its value for others, {constant.other:g}{until}"
            )
    return experiments.assign(**columns), notes


def is_given(constant: Constant, name: str) -> bool:
    """Return whether the system file lists the value of an experiment, or of the log that it is a part of."""
    return _listed(constant, name) in (constant.values or ())


def _listed(constant: Constant, name: str) -> str:
    """The id under which a constant has its value: of a part without a value of its own, that of the log."""
    return name if name in (constant.values or ()) else name.rpartition(PART)[0] or name
