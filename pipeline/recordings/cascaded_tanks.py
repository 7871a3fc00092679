"""Measurements of two cascaded tanks, a public benchmark of system identification.

M. Schoukens and J.P. Noël, "Three benchmarks addressing open challenges in nonlinear system identification",
IFAC World Congress, 2017; nonlinearbenchmark.org.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.recordings.archive import Archive
from pipeline.recordings.log_folder import Experiment, Recording, parts

FILE = "dataBenchmark.csv"
PERIOD = 4.0  # s
#: The two records: columns of the pump's voltage and of the level of the lower tank, both in V.
RECORDS = {"est": ("uEst", "yEst"), "val": ("uVal", "yVal")}


@dataclass(frozen=True)
class CascadedTanksRecording(Recording):
    """The two records as a log folder, each divided into equally long experiments.

    Attributes:
        archive: path of a zip file or folder with `FILE`.
        parts: number of experiments per record; default 3.
    """

    archive: str | None
    parts: int = 3

    about = {  # noqa: RUF012
        "description": "public measurements of two cascaded tanks: voltage of the pump, lower level",
        "url": "https://www.nonlinearbenchmark.org/benchmarks/cascaded-tanks",
    }

    def experiments(self) -> list[Experiment]:
        archive = Archive(self.archive, "CASCADED_TANKS")
        name = archive.names(FILE)[0]
        table = archive.table(name, [column for record in RECORDS.values() for column in record])
        experiments = []
        for record, (u, y) in RECORDS.items():
            samples = pd.DataFrame({"t": PERIOD * np.arange(len(table)), "u": table[u], "y": table[y]})
            cut = enumerate(parts(samples, self.parts, archive.where(name)), start=1)
            experiments += [Experiment(f"{record}_{k}", part) for k, part in cut]
        return experiments
