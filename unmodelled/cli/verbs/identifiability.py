"""Rank the parameter sets that can be identified together with networks in the ports."""

from __future__ import annotations

from pathlib import Path

from unmodelled.base.ownership import verb


@verb()
def identifiability(
    system: Path, logs: Path, parameters: list[str] | None, limit: float, floor: float, out: Path
) -> None:
    """Write and print the sensitivities of parameters, their absorption by networks, and sets to identify.

    `sensitivity.parquet`: name, kind (effort, parameter), norm (rms change of the states' derivatives, in
    units of their rms, for a change by the parameter's value or the effort's rms), unabsorbed (share of its
    energy that networks in the ports cannot absorb; missing for an effort). `correlation.parquet`: row,
    column, correlation, the text's Q. `advice.parquet`: a row per set of up to four parameters, the best
    first: set, collinearity (efforts' columns included), collinearity_with_network (of the parts that
    networks cannot absorb), identifiable, with_network, maximal. `identifiability.json`: the content of the
    tables, and the advice in sentences.

    Args:
        system: system file.
        logs: log folder.
        parameters: names of the parameters to study, [m3,J1,B_m] for instance; null: all parameters.
        limit, floor: see `unmodelled.api.parameter_study.identifiability`.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when the system or the logs cannot be used, or a parameter does not exist.
    """
    # what takes seconds to load, after the checks of `verb`
    from unmodelled.api.parameter_study import identifiability as studied

    found = studied(system, logs, parameters, limit, floor)
    found.save(out)
    print(found)
