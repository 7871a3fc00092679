"""Tables and looks of machines and methods, shared by the figures of the withheld check."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from unmodelled.base.parquet import read_parquet
from unmodelled.report.figures.style import BLACK, GREEN, GREY, ORANGE, PURPLE, SKY, Look

INDIGO, WINE = "#332288", "#882255"  # of Tol's palette, beside that of Okabe and Ito

MACHINES = {
    "slider_crank": Look("slider-crank", ORANGE, "s"),
    "cam_drive": Look("cam drive", SKY, "o"),
    "hoist": Look("hoist", GREEN, "^"),
    "belt_axis": Look("belt axis", INDIGO, "D"),
    "pendulum": Look("pendulum", PURPLE, "v"),
}
#: Who finds an effect, see `scores.detection`.
FINDERS = {
    "oracle": Look("can be seen (oracle)", BLACK, "o", "--"),
    "in_set": Look("named, or said to be indistinguishable", WINE, "s"),
    "top1": Look("named first", INDIGO, "^"),
    "sparse_regression": Look("sparse regression", GREY, "X"),
}
KINDS = {
    "single": "one effect",
    "local": "one effect in some of the runs",
    "pair": "two effects",
    "null": "none",
    "outside": "an effect of no family",
}


def table(data: Path, name: str) -> pd.DataFrame:
    """Read a table written by the verb tabulate_withheld."""
    return read_parquet(data / "tables" / "withheld" / f"{name}.parquet")


def readable(name: str) -> str:
    """Format the name of a family or verdict as words."""
    return name.replace("_", " ")
