"""Which parameters can be identified together with networks in the ports (section 4.4.4, appendix 4.7)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing, write_json
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import write_parquet
from unmodelled.explanation.advice import advise
from unmodelled.explanation.identifiability import Identifiability, identify_sets
from unmodelled.logs.folder import read_logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

SCHEMA = "identifiability/1"
SHOWN = 8


@verb()
def identifiability(
    system: Path, logs: Path, parameters: list[str] | None, limit: float, floor: float, out: Path
) -> None:
    """Write and print how sensitive parameters are, what networks absorb of them, which sets to identify.

    `sensitivity.parquet`: name, kind (effort, parameter), norm (rms change of the states' derivatives, in
    units of their rms, for a change by the parameter's value or the effort's rms), unabsorbed (share of its
    energy that networks in the ports leave; missing for an effort). `correlation.parquet`: row, column,
    correlation, the text's Q. `advice.parquet`: a row per set of up to four parameters, the best first: set,
    collinearity (efforts' columns included), collinearity_with_network (of what networks leave),
    identifiable, with_network, maximal. `identifiability.json`: all of it and the advice in sentences.

    Args:
        system: system file.
        logs: log folder.
        parameters: names to study, [m3,J1,B_m] for instance; all if null.
        limit: of the collinearity index of a set; 5 (strict) to 20 is usual.
        floor: sensitivity that a parameter must have, as a share of the largest.
        out: folder that is new, empty or was made by this verb.

    Raises:
        BadInput: when the system or the logs cannot be used, or a parameter does not exist.
    """
    model = read_system(system)
    given: object = parameters  # a configuration may hold anything
    if given is not None and (isinstance(given, str) or not isinstance(given, Sequence)):
        raise BadInput(f"parameters: must be a list of names, [{parameters}] for instance")
    for key, value in {"limit": limit, "floor": floor}.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise BadInput(f"{key}: must be a number, got {value!r}")
    chosen = None if parameters is None else [str(name) for name in parameters]
    result = identify_sets(model, read_logs(logs, model), chosen, limit, floor)
    advice = advise(model, result)
    tables = {
        "sensitivity": _sensitivity(result),
        "correlation": _correlation(result),
        "advice": _sets(result),
    }
    for name, table in tables.items():
        with replacing(out / f"{name}.parquet") as temporary:
            write_parquet(table, temporary)
    write_json(out / "identifiability.json", _content(model, result, advice))
    print(_printed(result, advice))


def _sensitivity(result: Identifiability) -> pd.DataFrame:
    rows = [
        (name, "effort" if name in result.found.efforts else "parameter", norm, result.unabsorbed.get(name))
        for name, norm in result.norms.items()
    ]
    return pd.DataFrame(rows, columns=["name", "kind", "norm", "unabsorbed"]).astype({"unabsorbed": float})


def _correlation(result: Identifiability) -> pd.DataFrame:
    rows = [(a, b, result.correlation_of(a, b)) for a in result.norms for b in result.norms]
    return pd.DataFrame(rows, columns=["row", "column", "correlation"])


def _sets(result: Identifiability) -> pd.DataFrame:
    table = pd.DataFrame([vars(s) for s in result.sets])
    return table.assign(names=table["names"].map(", ".join)).rename(columns={"names": "set"})


def _content(system: System, result: Identifiability, advice: list[str]) -> dict[str, Any]:
    parameters = {
        p.name: {
            "absorbed": p.name in result.absorbed,
            "marked": p.identify,
            "sensitive": p.name in result.sensitive,
            "sensitivity": result.norms[p.name],
            "unabsorbed": result.unabsorbed[p.name],
            "unit": p.unit,
            "value": p.value,
        }
        for p in system.parameters
        if p.name in result.found.parameters
    }
    efforts = {
        p.effort: {"port": p.name, "sensitivity": result.norms[p.effort], "unit": p.unit}
        for p in system.ports
    }
    return {
        "schema": SCHEMA,
        "system": system.name,
        "limit": result.limit,
        "floor": result.floor,
        "efforts": efforts,
        "parameters": parameters,
        "correlation": {a: {b: result.correlation_of(a, b) for b in result.norms} for a in result.norms},
        "sets": [vars(s) | {"names": list(s.names)} for s in result.sets],
        "advice": advice,
        "notes": list(result.found.notes),
    }


def _printed(result: Identifiability, advice: list[str]) -> str:
    lines = [f"{'':<14}{'sensitivity':>12}{'left by networks':>18}"]
    for name, norm in result.norms.items():
        left = f"{100.0 * result.unabsorbed[name]:.1f} %" if name in result.unabsorbed else ""
        lines.append(f"{name:<14}{norm:>12.4f}{left:>18}".rstrip())
    lines += ["", f"{'set':<34}{'collinearity':>12}{'beside networks':>18}{'identifiable':>14}"]
    for s in result.sets[:SHOWN]:
        numbers = f"{s.collinearity:>12.3g}{s.collinearity_with_network:>18.3g}"
        lines.append(f"{', '.join(s.names):<34}{numbers}{'yes' if s.both else 'no':>14}")
    return "\n".join(
        [*lines, "", *(f"- {line}" for line in advice), "", *(f"note: {n}" for n in result.found.notes)]
    )
