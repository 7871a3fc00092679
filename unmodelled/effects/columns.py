"""Constants of an experiment that an effect needs: which experiments it acts in, and values of their own."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import Field, dataclass, replace
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from unmodelled.systems.model import Constant, System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Member:
    """1 in the experiments whose column `factor` of experiments.csv is `level`, else 0."""

    factor: str
    level: float | str

    def __call__(self, experiments: pd.DataFrame) -> Array:
        """(n,) from the table of the n experiments."""
        member: Array = (experiments[self.factor] == self.level).to_numpy(np.float64)
        return member


@dataclass(frozen=True)
class Order:
    """The number of the experiment, from 0 in the order of experiments.csv."""

    def __call__(self, experiments: pd.DataFrame) -> Array:
        """(n,) from the table of the n experiments."""
        return np.arange(len(experiments), dtype=np.float64)


Column = Member | Order


class Experiments(Protocol):
    """The part of `Logs` that holds the operating points."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    @property
    def experiments(self) -> pd.DataFrame: ...
    @property
    def constants(self) -> tuple[str, ...]: ...
    @property
    def c(self) -> Array: ...


L = TypeVar("L", bound=Experiments)


def extended(logs: L, columns: Mapping[str, Column | Array]) -> L:
    """The same logs with more constants of the operating point, values (n,) or a `Column` each.

    They take the place of columns of the same name. The states are still those of the system as it was, see
    `prepare`.
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


def in_columns(system: System, names: Collection[str]) -> System:
    """The system with some parameters as constants of the operating point, one value per experiment."""
    moved = tuple(Constant(p.name, p.unit) for p in system.parameters if p.name in names)
    kept = tuple(p for p in system.parameters if p.name not in names)
    return replace(system, parameters=kept, operating_point=(*system.operating_point, *moved))
