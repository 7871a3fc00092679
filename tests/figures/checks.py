"""What every figure must do, whatever its chapter."""

import io
from collections.abc import Callable, Mapping
from pathlib import Path

import pandas as pd
import yaml
from hydra.utils import get_method
from matplotlib.figure import Figure

from unmodelled.report.figures.style import save

Draw = Callable[[Path], Figure]
CONF = Path(__file__).parents[2] / "conf"


def figures_of(*parts: str) -> list[Draw]:
    """The functions that conf/draw.yaml names in these files and folders of pipeline/figures."""
    config = yaml.safe_load((CONF / "draw.yaml").read_text())
    targets = [entry["_target_"] for entry in config["figures"].values()]
    return [get_method(target) for target in targets if target.split(".")[2] in parts]


def write_tables(folder: Path, chapter: str, tables: Mapping[str, pd.DataFrame]) -> Path:
    """Tables of one chapter where figures look for them; the data folder."""
    target = folder / "tables" / chapter
    target.mkdir(parents=True)
    for name, table in tables.items():
        table.to_parquet(target / f"{name}.parquet", index=False)
    return folder


def name_of(draw: Draw) -> str:
    return draw.__name__


def check_caption(draw: Draw) -> None:
    """A sentence, and a note that explains."""
    caption, _, note = (draw.__doc__ or "").strip().partition("\n\n")
    assert caption.endswith(".")
    assert len(note) > 80


def check_file(draw: Draw, folder: Path, out: Path) -> None:
    """Small, and the same every time."""
    paths = [out / "one.svg", out / "two.svg"]
    for path in paths:
        save(draw(folder), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert paths[0].stat().st_size < 1_000_000


def check_rendered(draw: Draw, folder: Path) -> Figure:
    """The figure, which can be written as SVG."""
    figure = draw(folder)
    save(figure, image := io.BytesIO())
    assert b"</svg>" in image.getvalue(), draw.__name__
    return figure
