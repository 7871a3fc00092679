"""The augmented system file: the known physics with laws, identified numbers and delays of the effects."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from unmodelled.base.next_step import AUGMENTED
from unmodelled.diagnosis.data.remark import quantity
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis
from unmodelled.effects.columns import Member
from unmodelled.effects.substitution import with_right_number
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import Constant, Parameter, System
from unmodelled.systems.writer import write_system

FILE = AUGMENTED


def write_augmented(diagnosis: Diagnosis, folder: Path) -> None:
    """Write `augmented_system.yaml`, and its tables as CSV files beside it.

    Simulated along the diagnosed experiments, it has the gap of `diagnosis.augmented`. Constants that effects
    need of an experiment are in the file by id, so that the log folder stays as it is.
    """
    write_system(augmented_system(diagnosis), folder / FILE)


def augmented_system(diagnosis: Diagnosis) -> System:
    """Return the augmented system with values of all constants that experiments.csv does not have."""
    model, own = diagnosis.augmented, {c.name for c in diagnosis.system.operating_point}
    constants = tuple(
        c if c.name in own else _given(c, model.logs, diagnosis.effects) for c in model.system.operating_point
    )
    parameters = tuple(_within_bounds(p) for p in model.system.parameters)
    grown = replace(model.system, operating_point=constants, parameters=parameters)
    return with_right_numbers(grown, diagnosis.effects)


def with_right_numbers(system: System, effects: Sequence[DiagnosedEffect]) -> System:
    """Return an augmented system in which wrong numbers of the file have their right values, and no law."""
    for added in (found.added for found in effects if found.added.is_other_value):
        system = with_right_number(system, added.place.name, *added.amplitudes)
    return system


def beyond_the_data(diagnosis: Diagnosis) -> Iterator[str]:
    """Yield notes on fitted curves, which end where the data end."""
    values = {p.name: p for p in diagnosis.augmented.system.parameters}
    for added in (found.added for found in diagnosis.effects):
        for name, edges in added.extent.items():
            low, high = (values[edge].value for edge in edges)
            farthest = quantity(high, values[edges[0]].unit)
            yield (
                f"{added.law} was fitted for {name} from {low:.3g} to {farthest}; beyond, the exported "
                "file goes on straight, which no measurement supports: log more travel to use it there"
            )


def _given(constant: Constant, logs: Logs, effects: tuple[DiagnosedEffect, ...]) -> Constant:
    """A constant that the diagnosis added, with its default for new experiments.

    A new experiment belongs to no known group. Where a number differs between experiments, it has the mean of
    the fitted ones until its own is fitted. In an order it stands where the last known experiment stands.
    """
    column = logs.c[:, logs.constants.index(constant.name)]
    values = dict(zip(logs.ids, column.tolist(), strict=True))
    columns = {name: kind for found in effects for name, kind in found.added.columns.items()}
    if constant.name not in columns:
        return replace(constant, values=values)
    member = isinstance(columns[constant.name], Member)
    return replace(constant, values=values, other=0.0 if member else max(values.values()))


def _within_bounds(parameter: Parameter) -> Parameter:
    """A fit can end at a bound plus rounding, and a file with a value beyond its bounds is refused."""
    if parameter.bounds is None:
        return parameter
    low, high = parameter.bounds
    return replace(parameter, value=min(max(parameter.value, low), high))
