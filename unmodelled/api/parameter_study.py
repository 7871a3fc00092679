"""Determine which parameters of a system can be identified from its logs: a result with tables and advice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.base.tables import write_table
from unmodelled.design.advice import advise
from unmodelled.design.identifiability import Identifiability, identify_sets
from unmodelled.logs.inputs import LogsGiven, read_inputs
from unmodelled.logs.logs import Logs
from unmodelled.systems.given import SystemGiven
from unmodelled.systems.model import System

SCHEMA = "identifiability/1"
#: Sets that are printed.
SHOWN = 8


@dataclass(frozen=True, eq=False, repr=False)
class ParameterStudy:
    """Study of the identifiability of parameters, alone and beside networks; made by `identifiability`.

    Attributes:
        system: studied system.
        logs: measured experiments.
        found: sensitivities, correlations and sets.
    """

    system: System
    logs: Logs
    found: Identifiability

    @cached_property
    def advice(self) -> tuple[str, ...]:
        """Return in sentences which parameters to identify, to separate and to hold fixed."""
        return tuple(advise(self.system, self.found))

    @property
    def sensitivity(self) -> pd.DataFrame:
        """Return how sensitive the model is to efforts and parameters, a row each.

        Columns: name, kind (effort, parameter), norm (rms change of the states' derivatives, in units of
        their rms, for a change by the parameter's value or the effort's rms), unabsorbed (share of its energy
        that networks in the ports leave, 0 to 1; nan for an effort).
        """
        found = self.found
        rows = [
            (name, "effort" if name in found.found.efforts else "parameter", norm, found.unabsorbed.get(name))
            for name, norm in found.norms.items()
        ]
        table = pd.DataFrame(rows, columns=["name", "kind", "norm", "unabsorbed"])
        return table.astype({"unabsorbed": float})

    @property
    def correlation(self) -> pd.DataFrame:
        """Return row, column and correlation of the effects of every two efforts or parameters, -1 to 1."""
        norms = self.found.norms
        rows = [(a, b, self.found.correlation_of(a, b)) for a in norms for b in norms]
        return pd.DataFrame(rows, columns=["row", "column", "correlation"])

    def table(self) -> pd.DataFrame:
        """Return the sets of up to four parameters, the best first.

        Columns: set, collinearity (efforts' columns included; 1 or more), collinearity_with_network (of what
        networks leave), identifiable and with_network (whether the two views allow the set), maximal (whether
        both do, and no larger set that contains it).
        """
        table = pd.DataFrame([vars(s) for s in self.found.sets])
        return table.assign(names=table["names"].map(", ".join)).rename(columns={"names": "set"})

    def save(self, folder: Path | str) -> None:
        """Write the tables sensitivity, correlation and advice (the sets), and identifiability.json.

        The tables are Parquet files, or CSV files if pyarrow is not installed.

        Args:
            folder: folder that is new, empty or holds an older study; replaced as a whole.

        Raises:
            BadInput: when the folder may not be replaced or cannot be written.
        """
        sources = {"system": self.system.source, "logs": self.logs.source}
        tables = {"sensitivity": self.sensitivity, "correlation": self.correlation, "advice": self.table()}
        with writing("identifiability", Path(folder), sources), replacing_folder(Path(folder)) as new:
            for name, table in tables.items():
                write_table(table, new / name)
            write_json(new / "identifiability.json", self._content())

    def __repr__(self) -> str:
        found = self.found
        lines = [f"{'':<14}{'sensitivity':>12}{'left by networks':>18}"]
        for name, norm in found.norms.items():
            left = f"{100.0 * found.unabsorbed[name]:.1f} %" if name in found.unabsorbed else ""
            lines.append(f"{name:<14}{norm:>12.4f}{left:>18}".rstrip())
        lines += ["", f"{'set':<34}{'collinearity':>12}{'beside networks':>18}{'identifiable':>14}"]
        for s in found.sets[:SHOWN]:
            numbers = f"{s.collinearity:>12.3g}{s.collinearity_with_network:>18.3g}"
            lines.append(f"{', '.join(s.names):<34}{numbers}{'yes' if s.both else 'no':>14}")
        advice, notes = (f"- {line}" for line in self.advice), (f"note: {n}" for n in found.found.notes)
        return "\n".join([*lines, "", *advice, "", *notes])

    def _repr_html_(self) -> str:
        sets = self.table().head(SHOWN)
        tables = {"Sensitivity": self.sensitivity, "Sets of parameters, the best first": sets}
        return shown(f"Identifiability of {self.system.name}", self.advice, tables)

    def _content(self) -> dict[str, Any]:
        """Return the content of identifiability.json."""
        found, system = self.found, self.system
        parameters = {
            p.name: {
                "absorbed": p.name in found.absorbed,
                "marked": p.identify,
                "sensitive": p.name in found.sensitive,
                "sensitivity": found.norms[p.name],
                "unabsorbed": found.unabsorbed[p.name],
                "unit": p.unit,
                "value": p.value,
            }
            for p in system.parameters
            if p.name in found.found.parameters
        }
        efforts = {
            p.effort: {"port": p.name, "sensitivity": found.norms[p.effort], "unit": p.unit}
            for p in system.ports
        }
        return {
            "schema": SCHEMA,
            "system": system.name,
            "limit": found.limit,
            "floor": found.floor,
            "efforts": efforts,
            "parameters": parameters,
            "correlation": {a: {b: found.correlation_of(a, b) for b in found.norms} for a in found.norms},
            "sets": [vars(s) | {"names": list(s.names)} for s in found.sets],
            "advice": list(self.advice),
            "notes": list(found.found.notes),
        }


def identifiability(
    system: SystemGiven,
    logs: LogsGiven,
    parameters: Sequence[str] | None = None,
    limit: float = 5.0,
    floor: float = 0.05,
) -> ParameterStudy:
    """Find out which parameters can be identified from logs, alone and beside networks in the ports.

    Args:
        system: system with the nominal values of its parameters, or the path of its file.
        logs: measured experiments, read for this system, the path of their folder, or data frames.
        parameters: names of the parameters to study; default: all.
        limit: largest collinearity index of a set, larger than 1; 5 (strict, default) to 20 is usual.
        floor: sensitivity that a parameter must have, as a share of the largest (at most 1), 0 to 1; default
            0.05.

    Returns:
        Sensitivities, correlations, sets of parameters, and advice in sentences.

    Raises:
        BadInput: when a parameter does not exist, or the limit or the floor is out of range.

    Examples:
        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> study = um.identifiability(system, logs)
        >>> study.advice[1]
        '{J} can be identified together'
        >>> study.table()[["set", "identifiable", "with_network"]].head(3)
                 set  identifiable  with_network
        0          J          True          True
        1  J, b, mgl          True         False
        2     J, mgl          True         False
    """
    given: object = parameters  # a configuration may hold anything
    if given is not None and (isinstance(given, str) or not isinstance(given, Sequence)):
        raise BadInput(f"parameters: must be a list of names, [{parameters}] for instance")
    for key, value in {"limit": limit, "floor": floor}.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise BadInput(f"{key}: must be a number, got {value!r}")
    chosen = None if parameters is None else [str(name) for name in parameters]
    known, measured = read_inputs(system, logs)
    return ParameterStudy(known, measured, identify_sets(known, measured, chosen, limit, floor))
