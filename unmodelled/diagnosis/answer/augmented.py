"""The augmented system file: the known physics with laws, identified numbers and delays of the effects."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from difflib import unified_diff
from pathlib import Path
from tempfile import TemporaryDirectory

from unmodelled.base.errors import BadInput
from unmodelled.base.next_step import AUGMENTED
from unmodelled.diagnosis.data.remark import listed, quantity
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis
from unmodelled.effects.columns import Member
from unmodelled.effects.substitution import with_right_number
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import Constant, Parameter, System
from unmodelled.systems.reader import read_system
from unmodelled.systems.writer import write_system

FILE = AUGMENTED
#: Lines of the given file that stand around a changed one.
AROUND = 1


def write_augmented(diagnosis: Diagnosis, folder: Path, made: str = "") -> None:
    """Write `augmented_system.yaml`, and its tables as CSV files beside it.

    It is the file of the given system with the changed entries; its first lines say from what it was `made`.

    Simulated along the diagnosed experiments, it has the gap of `diagnosis.augmented`. Constants that effects
    need of an experiment are in the file by id, so that the log folder stays as it is.
    """
    write_system(
        augmented_system(diagnosis), folder / FILE, given_again(diagnosis.system), _origin(diagnosis, made)
    )


def write_changes(diagnosis: Diagnosis, folder: Path, into: Path) -> None:
    """Write which lines of the given file `augmented_system.yaml` in a folder changes (unified diff)."""
    system, name = diagnosis.system, f"{diagnosis.system.name}.yaml"
    if given_again(system) is None:
        with TemporaryDirectory() as other:
            write_system(system, Path(other) / name)
            before = (Path(other) / name).read_text(encoding="utf-8")
    else:
        name, before = Path(system.source).name, Path(system.source).read_text(encoding="utf-8")
    old, new = before.splitlines(), (folder / FILE).read_text(encoding="utf-8").splitlines()
    lines = unified_diff(old, new, name, FILE, lineterm="", n=AROUND)
    into.write_text("\n".join(lines), encoding="utf-8")


def given_again(system: System) -> System | None:
    """Return a given system as its file says it; None where there is no such file any more."""
    try:
        return read_system(system.source) if system.source else None
    except BadInput:
        return None


def _origin(diagnosis: Diagnosis, made: str) -> str:
    """From which answer the file came, and when."""
    found = [f"{effect.added.title} (confidence {effect.confidence:.2f})" for effect in diagnosis.effects]
    what = listed(found) if found else "refitted parameters"
    files = [Path(place).name for place in (diagnosis.system.source, diagnosis.logs.source) if place]
    of = f" of {' and '.join(files)}" if files else ""
    when = f", {made}" if made else ""
    return f"{diagnosis.system.name} with {what}\nfrom the answer beside this file, the diagnosis{of}{when}"


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
