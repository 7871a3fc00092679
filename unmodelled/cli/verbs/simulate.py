"""Simulate a system file along measured experiments, and compute the gap between the two."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from unmodelled.base.ownership import verb

#: What to do with the result (`unmodelled.cli.written`).
NEXT = "the cause of the gap: {program} diagnose system={system} logs={logs}"


@verb()
def simulate(
    system: Path, logs: Path, horizon: float | None, out: Path, only: Sequence[str] | str | None = None
) -> None:
    """Write simulation.parquet (.csv without pyarrow), simulation.json and index.html, and print the gap.

    The gap, its noise floor, the error of persistence (every output keeps its value or its speed) and the
    scale of every output are those of `diagnose`: standard deviations within runs, over all experiments of
    the logs, also if only some are simulated. Root mean square errors in units of the outputs are added, at
    the horizon and over whole runs.

    The table has a row per sample: experiment, t (s), window, and of every output `<name>_measured` and
    `<name>_simulated` in its unit; if an output has a delay, nan at the first or last samples, which no
    window reaches. A simulated value that diverged is cut ten standard deviations from the measured one, as
    in the gap.

    The page, index.html, shows how far off the model is and where. It simulates the machine itself, so that
    its parameters can be moved; it is one file and needs no network.

    Args:
        system: file of the known physics (system/1).
        logs: folder of the measured experiments.
        horizon: see `unmodelled.api.simulation.simulate`.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        only: ids of the experiments to simulate, [run1,run2] for instance; null: all experiments.

    Raises:
        BadInput: when the system file, the logs, the horizon or an id cannot be used.
    """
    # what takes seconds to load, after the checks of `verb`
    from unmodelled.api.simulation import simulate as simulated

    found = simulated(system, logs, horizon, only)
    found.save(out)
    print(found)
