"""Columns of logs that show no course, each with the reason."""

from __future__ import annotations

import numpy as np

from unmodelled.base.errors import first_few, printable
from unmodelled.drafting.columns import ROWS, VALUES
from unmodelled.drafting.draft import Draft
from unmodelled.drafting.names import Role, meaning_of
from unmodelled.logs.readers.reader import Table

#: Names that a line gives in full.
NAMES = 40


def left_out(draft: Draft) -> list[str]:
    """Return a line for every reason for which columns were left out, with their names."""
    known = {signal.address for signals in draft.experiments for signal in signals} | {draft.split_by}
    found: dict[str, str] = {}
    for tables in draft.survey.read.values():
        for table in tables:
            shown = {own: other for other, own in table.aliases.items() if table.address(other) in known}
            for name in (*table.columns, *table.texts):
                address = table.address(shown.get(name, name))
                used = name == draft.timing.column or _is_of_the_file(table, name)
                if known.isdisjoint({address, name}) and not used:
                    found.setdefault(address, _reason(table, name))
    reasons = list(dict.fromkeys(found.values()))
    named = ((reason, [a for a, other in found.items() if other == reason]) for reason in reasons)
    return [printable(f"left out, {reason}: {first_few(names, NAMES)}") for reason, names in named]


def _is_of_the_file(table: Table, name: str) -> bool:
    """Whether a column gives the times of a table with a clock, or the name of a thing of a long table."""
    if name in table.texts:
        return {*table.texts[name]} == {table.name}
    return table.clock is not None and _is_time(table, name)


def _is_time(table: Table, name: str) -> bool:
    return name in table.origins or meaning_of(name, table.units.get(name)).role is Role.TIME


def _reason(table: Table, name: str) -> str:
    if name in table.texts:
        return "text"
    if _is_time(table, name):
        return "another clock"
    values = table.columns[name]
    values = values[np.isfinite(values)]
    if len(np.unique(values)) < VALUES:
        return "one value in a file" if len(values) else "no number"
    return f"fewer than {ROWS} values" if len(values) < ROWS else "no value at increasing times"
