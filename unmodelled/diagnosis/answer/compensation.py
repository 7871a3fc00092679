"""Tables that compensate errors of sensors: what to add to a shown value, in the unit of the log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.base.files import replacing
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis
from unmodelled.effects.added import RIGHT, Added
from unmodelled.systems.model import symbol
from unmodelled.systems.numeric import numpy_function

#: Rows of a table, a degree apart in a turn.
ROWS = 360
#: Cycles, spread over those of the logs, whose corrections a row joins.
_CYCLES = 50
#: Steps of Newton's method, and the largest error that they may leave, as a share of the largest correction.
_STEPS, _LEFT = 50, 1e-6


def write_compensations(diagnosis: Diagnosis, folder: Path) -> None:
    """Write a CSV file for every sensor whose error a table compensates.

    Columns: the shown value, what to add to it, and the ends of the 95 % interval of that, in the units of
    the log. Rows are evenly spaced over a cycle from zero, or over the logged values where the error does not
    come again. Between rows, interpolate.
    """
    for name, table in compensations(diagnosis).items():
        with replacing(folder / name) as temporary:
            table.to_csv(temporary, index=False, float_format="%.8g")


def file_of(added: Added) -> str:
    """Return the name of the table that compensates the sensor of an effect."""
    return f"compensation_{added.place.name}.csv"


def is_compensated(found: DiagnosedEffect) -> bool:
    """Return whether an effect is an error of a sensor that is the same in all experiments."""
    return found.added.cycle is not None and found.added.place.factor is None and not found.own


def compensations(diagnosis: Diagnosis) -> dict[str, pd.DataFrame]:
    """Return the tables of `write_compensations` by name of the file.

    A sensor that shows the same value twice within the logs has none.
    """
    tables = {}
    found = [each for each in diagnosis.effects if is_compensated(each)]
    for output in {each.added.place.name for each in found}:
        # an error acts on what the errors before it show
        own = sorted((e for e in found if e.added.place.name == output), key=lambda e: _size(e.added))
        table = _Compensation(diagnosis, output, own).table
        if table is not None:
            tables[file_of(own[0].added)] = table
    return tables


def _size(added: Added) -> int:
    return len(added.system.parameters)


@dataclass(frozen=True, eq=False)
class _Compensation:
    diagnosis: Diagnosis
    output: str
    effects: Sequence[DiagnosedEffect]  # at the output, in the order in which they act

    @property
    def table(self) -> pd.DataFrame | None:
        """Return the table; None where the shown value does not tell the right one."""
        shown, cycles = self._rows
        lines = shown + cycles[:, None]
        right = self._right(lines)
        if right is None:
            return None
        (item,) = (o for o in self.diagnosis.system.outputs if o.name == self.output)
        written, unit = item.as_written, item.as_difference
        add, half = right - lines, self._half_width(right)
        columns = {"add": add.mean(0), "low": (add - half).min(0), "high": (add + half).max(0)}
        return pd.DataFrame(
            {f"{item.column} [{written.text}]": written.from_si(shown)}
            | {f"{name} [{unit.text}]": values / unit.factor for name, values in columns.items()}
        )

    @property
    def _rows(self) -> tuple[Array, Array]:
        """Shown values of the rows, and what the logged cycles add to them, SI."""
        logs, cycle = self.diagnosis.logs, max(e.added.cycle or 0.0 for e in self.effects)
        logged = logs.y[:, logs.outputs.index(self.output)]
        low, high = float(np.nanmin(logged)), float(np.nanmax(logged))
        if not np.isfinite(cycle):
            return np.linspace(low, high, ROWS), np.zeros(1)
        numbers = np.linspace(np.floor(low / cycle), np.floor(high / cycle), _CYCLES)
        return np.arange(ROWS) * cycle / ROWS, np.unique(np.round(numbers)) * cycle

    @cached_property
    def _shows(self) -> sp.Expr:
        """What the sensor shows, over what it should show and the numbers of the effects."""
        shows: sp.Expr = RIGHT
        for found in self.effects:
            shows = shows + found.added.error.xreplace({RIGHT: shows})
        return shows

    def _at(self, expression: sp.Expr, right: Array) -> Array:
        """Values of an expression with the fitted numbers."""
        values = {symbol(p.name): sp.Float(p.value) for p in self.diagnosis.augmented.system.parameters}
        return numpy_function(expression.xreplace(values), RIGHT)(right)

    def _right(self, shown: Array) -> Array | None:
        """What the sensor should show, by Newton's method; None where it shows less of more."""
        right, slope = shown, sp.diff(self._shows, RIGHT)
        if not (self._at(slope, shown) > 0.0).all():  # the rows are a cycle of what is right, too
            return None
        with np.errstate(all="ignore"):
            for _ in range(_STEPS):
                right = right - (self._at(self._shows, right) - shown) / self._at(slope, right)
            left = np.abs(self._at(self._shows, right) - shown).max()
        return right if left <= _LEFT * np.abs(right - shown).max() else None

    def _half_width(self, right: Array) -> Array:
        """Half of the 95 % interval of the corrections, of those of the numbers and their correlations."""
        each = {n: e for found in self.effects for n, e in found.estimates.items()}
        half = {n: 0.5 * (e.interval[1] - e.interval[0]) for n, e in each.items()}
        moves = np.array([w * self._at(sp.diff(self._shows, symbol(n)), right) for n, w in half.items()])
        known = self.diagnosis.correlations
        likeness = np.array([[known.get((a, b), float(a == b)) for b in each] for a in each])
        square = np.einsum("i...,ij,j...->...", moves, likeness, moves)
        return np.asarray(np.sqrt(np.maximum(square, 0.0)) / self._at(sp.diff(self._shows, RIGHT), right))
