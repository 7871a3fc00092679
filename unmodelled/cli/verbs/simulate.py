"""Free-run simulation of a system file along measured experiments, and the gap between the two."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.ownership import verb
from unmodelled.base.parquet import write_parquet
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.evaluation.gap import Gap, steps_of
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

#: What to do with the result (`unmodelled.cli.written`).
NEXT = "the cause of the gap: {program} diagnose system={system} logs={logs}"

TABLE, SUMMARY = "simulation.parquet", "simulation.json"


@verb()
def simulate(
    system: Path, logs: Path, horizon: float, out: Path, only: Sequence[str] | str | None = None
) -> None:
    """Write `simulation.parquet` and `simulation.json`, and print the gap.

    The gap, its noise floor and the scale of every output are those of `diagnose`: standard deviations within
    runs, over all experiments of the logs, whichever are simulated. Beside them stand the root mean square
    errors in units of the outputs, at the horizon and over whole runs.

    The table has a row per sample: experiment, t (s), window, and of every output `<name>_measured` and
    `<name>_simulated` in its unit, nan where an output with a delay shows nothing that was simulated. A
    simulated value that diverged is cut ten standard deviations from the measured one, as in the gap.

    Args:
        system: file of the known physics (system/1).
        logs: folder of the measured experiments.
        horizon: of the free-run windows, s.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        only: ids of the experiments to simulate, [run1,run2] for instance; all if null.

    Raises:
        BadInput: when the system file, the logs, the horizon or an id cannot be used.
    """
    system, logs, out = Path(system), Path(logs), Path(out)
    model = read_system(system)
    measured = read_logs(logs, model)
    runs = _chosen(only, measured)
    found = free_runs(model, measured, horizon, runs)
    with replacing_folder(out) as folder:
        write_parquet(_table(measured, found, runs), folder / TABLE)
        write_json(folder / SUMMARY, _summary(model, measured, horizon, found))
    worst = max(found.per_experiment, key=lambda name: found.per_experiment[name])
    seconds = steps_of(horizon, measured) * measured.period
    for name, off in found.units.items():
        print(f"{name}: {off.says(seconds)}")
    print(f"gap: {found.value:.3g} standard deviations over {seconds:.3g} s, {len(runs)} experiments")
    print(f"noise floor: {found.floor:.3g}, what the noise of the sensors alone leaves")
    print(f"worst experiment: {worst}, {found.per_experiment[worst]:.3g}")


def _chosen(only: Sequence[str] | str | None, logs: Logs) -> list[int]:
    """Numbers of the experiments, in their order."""
    if only is None:
        return list(range(len(logs)))
    ids = [str(name) for name in ([only] if isinstance(only, str | int | float) else only)]
    for name in ids:
        if name not in logs.ids:
            raise BadInput(f"only: there is no experiment {name!r}")
    if not ids:
        raise BadInput("only: names no experiment")
    return sorted({logs.ids.index(name) for name in ids})


def _table(logs: Logs, found: Gap, runs: list[int]) -> pa.Table:
    ids = pa.DictionaryArray.from_arrays(pa.array(logs.owner.astype(np.int32)), list(logs.ids))
    columns: dict[str, Any] = {"experiment": ids.cast(pa.string()), "t": logs.t, "window": found.run.window}
    for j, name in enumerate(logs.outputs):
        columns |= {f"{name}_measured": logs.y[:, j], f"{name}_simulated": found.run.y[:, j]}
    return pa.table(columns).filter(pa.array(np.isin(logs.owner, runs)))


def _summary(system: System, logs: Logs, horizon: float, found: Gap) -> dict[str, Any]:
    return {
        "schema": "simulation/1",
        "system": system.name,
        "horizon": float(horizon),
        "gap": {
            "known": found.value,
            "floor": found.floor,
            "units": {
                name: {"unit": off.unit, "known": off.at_horizon, "known_whole_run": off.whole_run}
                for name, off in found.units.items()
            },
        },
        "outputs": {
            output.name: {
                "gap": found.per_output[output.name],
                "unit": output.unit,
                "rmse": found.per_output[output.name] * found.scale[output.name],
                "std": found.scale[output.name],
            }
            for output in system.outputs
        },
        "experiments": [{"id": name, "known": value} for name, value in found.per_experiment.items()],
        "integration": {"method": "rk4", "substeps": found.substeps},
        "notes": [*logs.notes, *found.notes],
    }
