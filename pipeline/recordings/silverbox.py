"""Measurements of the Silverbox, an electronic oscillator with a hardening spring and a public benchmark.

T. Wigren and J. Schoukens, "Three free data sets for development and benchmarking in nonlinear system
identification", European Control Conference, 2013; nonlinearbenchmark.org.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.recordings.archive import Archive
from pipeline.recordings.log_folder import Experiment, Recording, parts
from unmodelled.base.errors import BadInput

FILE = "SNLS80mV.csv"
PERIOD = 2**14 / 1e7  # s
SAMPLES = 131_072
#: Rows of the noise whose amplitude grows, between the silences before and after it.
ARROW = slice(100, 40_500)
#: The multisine: row of the first realisation after the silence, rows from one to the next, rows without the
#: silence between two of them, number of realisations.
FIRST, STEP, LENGTH, REALISATIONS = 40_590, 8_692, 8_600, 10


@dataclass(frozen=True)
class SilverboxRecording(Recording):
    """The record as a log folder: parts of the growing noise (one group) and realisations of the multisine.

    Attributes:
        archive: path of a zip file or folder with `FILE`.
        parts: number of experiments that the growing noise is divided into; default 5.
    """

    archive: str | None
    parts: int = 5

    about = {  # noqa: RUF012
        "description": "public measurements of the Silverbox, an electronic oscillator: voltages",
        "url": "https://www.nonlinearbenchmark.org/benchmarks/silverbox",
    }

    def experiments(self) -> list[Experiment]:
        archive = Archive(self.archive, "SILVERBOX")
        name = archive.names(FILE)[0]
        record = archive.table(name, ["V1", "V2"])
        if len(record) != SAMPLES:
            raise BadInput(f"{archive.where(name)}: must have {SAMPLES} samples, got {len(record)}")
        record.insert(0, "t", PERIOD * np.arange(SAMPLES))
        arrow = enumerate(parts(record.iloc[ARROW], self.parts, archive.where(name)), start=1)
        experiments = [Experiment(f"arrow_{k}", part, {"group": "arrow"}) for k, part in arrow]
        experiments += [_realisation(record, k) for k in range(REALISATIONS)]
        return experiments


def _realisation(record: pd.DataFrame, k: int) -> Experiment:
    start, name = FIRST + k * STEP, f"multisine_{k + 1:02d}"
    return Experiment(name, record.iloc[start : start + LENGTH], {"group": name})
