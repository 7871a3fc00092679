"""Constants of single experiments that an effect needs: membership of a group, number, or fitted value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import Field, dataclass, replace
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.systems.model import Constant, System


@dataclass(frozen=True)
class Member:
    """Membership of a group of experiments: 1 if their column has a given value, otherwise 0."""

    factor: str  # column of experiments.csv
    level: float | str

    def __call__(self, experiments: pd.DataFrame) -> Array:
        """Return the values for the table of n experiments, shape (n,)."""
        member: Array = (experiments[self.factor] == self.level).to_numpy(np.float64)
        return member


@dataclass(frozen=True)
class Order:
    """Number of the experiment, from 0 in the order of experiments.csv."""

    def __call__(self, experiments: pd.DataFrame) -> Array:
        """Return the values for the table of n experiments, shape (n,)."""
        return np.arange(len(experiments), dtype=np.float64)


Column = Member | Order


class OperatingPoints(Protocol):
    """Part of `Logs` that holds the operating points."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    @property
    def experiments(self) -> pd.DataFrame:
        """Table of the experiments, one row each."""

    @property
    def constants(self) -> tuple[str, ...]:
        """Names of the constants of the operating point."""

    @property
    def c(self) -> Array:
        """Values of the constants, shape (experiments, constants)."""


L = TypeVar("L", bound=OperatingPoints)


def extended(logs: L, columns: Mapping[str, Column | Array]) -> L:
    """Return the logs with additional constants (n,) of the operating point.

    The states stay those of the system as it was; `prepare` estimates them anew.
    """
    values = {
        name: column(logs.experiments) if isinstance(column, Member | Order) else np.asarray(column)
        for name, column in columns.items()
    }
    return replace(
        logs,
        experiments=logs.experiments.assign(**values),
        constants=(*logs.constants, *values),
        c=np.column_stack([logs.c, *values.values()]),
    )


def in_columns(system: System, constants: Sequence[Constant]) -> System:
    """Return the system with some parameters turned into constants of the operating point."""
    names = [constant.name for constant in constants]
    kept = tuple(p for p in system.parameters if p.name not in names)
    return replace(system, parameters=kept, operating_point=(*system.operating_point, *constants))
