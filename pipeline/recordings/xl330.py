"""Measurements of a small XL330 position servo that swings a mass on a rod.

M. Duclusaud and G. Passault, "Extended friction models for the physics simulation of servo actuators", 2024
(arXiv 2410.08650); recordings of Rhoban/bam at github.com, commit af22604, folder bam/data.bak/raw,
Apache-2.0.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from pipeline.recordings.archive import Archive, measured
from pipeline.recordings.log_folder import Experiment, Recording, on_clock
from unmodelled.base.errors import BadInput

#: Columns of a log and the keys of an entry that they are made of. The servo reports its speed 20 ms late,
#: so it is left out.
COLUMNS = {"t": "timestamp", "goal": "goal_position", "on": "torque_enable", "theta": "position"}
#: Columns that jump.
HELD = ("goal", "on")
#: What must be the same in all runs, for the system file has one number for it: kg, m, V.
SHARED = ("mass", "length", "vin")


@dataclass(frozen=True)
class Xl330Recording(Recording):
    """Runs of 6 s as a log folder, one experiment each: four trajectories with four gains of the position
    loop.

    The runs were logged with 190 or 285 samples per second, and are resampled on one clock.

    Attributes:
        archive: path of a zip file or folder with the JSON files of the runs.
        period: sampling period of the logs, s; default 0.005.
    """

    archive: str | None
    period: float = 0.005

    about = {  # noqa: RUF012
        "description": "public measurements of an XL330 servo that swings a mass: command, angle",
        "url": "https://github.com/Rhoban/bam",
        "licence": "Apache-2.0",
    }

    def experiments(self) -> list[Experiment]:
        archive = Archive(self.archive, "XL330")
        names = archive.names("*.json")
        runs = [_run(archive, name) for name in names]
        experiments = []
        for name, run in zip(names, runs, strict=True):
            for key in SHARED:
                if run[key] != runs[0][key]:
                    wanted = f"{runs[0][key]:g} as in {names[0]}"
                    raise BadInput(f"{archive.where(name)}: {key}: must be {wanted}, got {run[key]:g}")
            samples = on_clock(_samples(archive, name, run), self.period, HELD, archive.where(name))
            experiments.append(Experiment(f"{run['trajectory']}_kp{run['kp']:g}", samples, {"kp": run["kp"]}))
        return experiments


def _run(archive: Archive, name: str) -> Mapping[str, Any]:
    """The header of a run with its entries."""
    try:
        run = json.loads(archive.read(name))
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{archive.where(name)}: not a JSON file ({error})") from None
    if not isinstance(run, dict) or not isinstance(run.get("entries"), list) or not run["entries"]:
        raise BadInput(f"{archive.where(name)}: entries: must be a list of samples")
    for key in ("kp", *SHARED):
        if measured(run.get(key)) is None:
            raise BadInput(f"{archive.where(name)}: {key}: must be a number, got {repr(run.get(key))[:30]}")
    if not str(run.get("trajectory", "")).isidentifier():
        raise BadInput(
            f"{archive.where(name)}: trajectory: must be a name, got {repr(run.get('trajectory'))[:30]}"
        )
    return run


def _samples(archive: Archive, name: str, run: Mapping[str, Any]) -> pd.DataFrame:
    columns: dict[str, list[float]] = {column: [] for column in COLUMNS}
    for row, entry in enumerate(run["entries"], start=1):
        for column, key in COLUMNS.items():
            logged = entry.get(key) if isinstance(entry, dict) else None
            if (value := measured(logged)) is None:
                shown = repr(logged)[:30]
                raise BadInput(f"{archive.where(name)}: entry {row}: {key}: must be a number, got {shown}")
            columns[column].append(value)
    return pd.DataFrame(columns)
