"""Measurements of the drivetrain of the cam-follower bench, in runs without follower jumps."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.recordings.log_folder import Experiment, write_log_folder
from pipeline.recordings.resample import resample
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder

FACTORS = ("H", "beta", "m")


@dataclass(frozen=True)
class CamDrivetrainRecording:
    """A full factorial sample of the contact runs of a campaign as a log folder.

    For every combination of levels, the run with the median voltage is taken (for an even number of runs the
    lower one of the two in the middle). The logs contain the angle only, because the bench filtered the speed
    before logging it. A log begins some time after the start from rest, because the time at which the supply
    was switched on is unknown. Runs with the same cam form a group, because the cam was mounted once for all
    of them.

    Attributes:
        trajectories: store written by `ingest`.
        H: levels of the stroke, m.
        beta: levels of the angle of the rise, rad.
        m: levels of the follower's mass, kg.
        start: duration that is left out at the start of every run, s; default 0.1.
        period: sampling period of the logs, s; default 0.004.
    """

    trajectories: str
    H: Sequence[float]
    beta: Sequence[float]
    m: Sequence[float]
    start: float = 0.1
    period: float = 0.004

    def write(self, folder: Path, seed: int) -> dict[str, Any]:
        """Replace a folder by a log folder, and return the provenance.

        Args:
            folder: folder that is replaced as a whole.
            seed: unused, because nothing is random.

        Raises:
            BadInput: when the store is missing, or a combination of levels has no contact run.
        """
        campaign = Campaign.read(Path(self.trajectories), ["t", "theta"])
        chosen = [self._run(campaign.experiments, levels) for levels in product(self.H, self.beta, self.m)]
        table = campaign.experiments.iloc[chosen]
        names = [f"exp{exp}" for exp in table["exp"]]
        experiments = []
        for row, name in zip(chosen, names, strict=True):
            log, run = campaign[row], campaign.experiments.iloc[row]
            t, (theta,) = resample(log["t"], log["theta"][None], self.period)
            kept = t >= t[0] + self.start
            samples = pd.DataFrame({"t": t[kept] - t[kept][0], "theta": theta[kept]})
            cam = f"H={run['H']:g} beta={run['beta']:.4g}"
            settings = {factor: float(run[factor]) for factor in (*FACTORS, "V")}
            experiments.append(Experiment(name, samples, {"group": cam, **settings}))
        with replacing_folder(folder) as out:
            write_log_folder(out, experiments)
        description = "contact runs of the cam-follower bench: angle of its cam shaft"
        return {**campaign.provenance, "description": description, "experiments": len(names)}

    def _run(self, experiments: pd.DataFrame, levels: tuple[float, ...]) -> int:
        near = np.isclose(experiments[list(FACTORS)], levels, rtol=1e-6).all(axis=1)
        rows = np.flatnonzero(near & (experiments["label"] == "contact"))
        if len(rows) == 0:
            wanted = ", ".join(f"{name} = {level:g}" for name, level in zip(FACTORS, levels, strict=True))
            raise BadInput(f"{self.trajectories}: experiments.parquet: no contact run with {wanted}")
        voltages = experiments["V"].to_numpy()[rows]
        return int(rows[np.argsort(voltages, kind="stable")[(len(rows) - 1) // 2]])
