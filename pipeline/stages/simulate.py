"""Free-run simulation of a system file along measured experiments, and the gap between the two."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from pipeline.errors import BadInput
from pipeline.evaluation.free_run import steps_of
from pipeline.evaluation.gap import Gap, gap
from pipeline.files import check_replaceable, replacing_folder, write_json
from pipeline.measurements.folder import read_logs
from pipeline.measurements.logs import Logs
from pipeline.parquet import write_parquet
from pipeline.physics.system.model import System
from pipeline.physics.system.reader import read_system

TABLE, SUMMARY = "simulation.parquet", "simulation.json"


def simulate(
    system: Path, logs: Path, horizon: float, out: Path, only: Sequence[str] | str | None = None
) -> None:
    """Write `simulation.parquet` and `simulation.json`, and print the gap.

    The table has a row per sample: experiment, t (s), window, and of every output `<name>_measured` and
    `<name>_simulated` in its unit, nan where an output with a delay shows nothing that was simulated. A
    simulated value that diverged is cut ten standard deviations from the measured one, as in the gap.

    Args:
        system: file of the known physics (system/1).
        logs: folder of the measured experiments.
        horizon: of the free-run windows, s.
        out: folder, replaced as a whole; refused if it holds anything else.
        only: ids of the experiments to simulate, [run1,run2] for instance; all if null.

    Raises:
        BadInput: when the system file, the logs, the horizon or an id cannot be used.
    """
    system, logs, out = Path(system), Path(logs), Path(out)
    check_replaceable(out, (TABLE, SUMMARY))
    model = read_system(system)
    measured = read_logs(logs, model)
    runs = _chosen(only, measured)
    found = gap(model, measured, horizon, runs)
    with replacing_folder(out) as folder:
        write_parquet(_table(measured, found, runs), folder / TABLE)
        write_json(folder / SUMMARY, _summary(model, measured, horizon, found))
    worst = max(found.per_experiment, key=lambda name: found.per_experiment[name])
    seconds = steps_of(horizon, measured) * measured.period
    print(f"gap: {found.value:.3g} standard deviations over {seconds:.3g} s, {len(runs)} experiments")
    print(f"floor: {found.floor:.3g}, what the noise of the sensors leaves")
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
        "gap": {"known": found.value, "floor": found.floor},
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
