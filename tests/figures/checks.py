"""What every figure must do, whatever its chapter, and what the tests of a chapter's figures draw."""

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from hydra.utils import get_method
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

from unmodelled.report.figures.style import save

Draw = Callable[[Path], Figure]
CONF = Path(__file__).parents[2] / "conf"
#: How many axes with numbers or names have no label, where a title or the names say what they show.
UNLABELLED = {
    **{"network_beyond_the_data": 1, "current_signals": 2, "density_estimates": 2, "mean_distances": 2},
    **{"network_inputs": 10, "sensitivities": 1, "correlations": 3, "simulation_drift": 6},
}


@dataclass(frozen=True)
class Chapter:
    """Figures of a chapter and small made-up data, from which they are drawn."""

    parts: tuple[str, ...]  # files and folders of pipeline/figures
    make: Callable[[], Any]  # the content of the data
    write: Callable[[Path, Any], Path]  # content where figures look for it, in a folder
    lacking: tuple[Callable[[Any], Any], ...] = ()  # what content becomes if something is missing

    @property
    def figures(self) -> list[Draw]:
        """The functions that conf/draw.yaml names in the files and folders."""
        config = yaml.safe_load((CONF / "draw.yaml").read_text())
        targets = [entry["_target_"] for entry in config["figures"].values()]
        return [get_method(target) for target in targets if target.split(".")[2] in self.parts]


def write_tables(folder: Path, chapter: str, tables: Mapping[str, pd.DataFrame]) -> Path:
    """Tables of one chapter where figures look for them; the data folder."""
    target = folder / "tables" / chapter
    target.mkdir(parents=True)
    for name, table in tables.items():
        table.to_parquet(target / f"{name}.parquet", index=False)
    return folder


def texts(figure: Figure) -> str:
    return " ".join(text.get_text() for text in figure.findobj(Text))  # type: ignore[attr-defined]


def entries(legend: Legend | None) -> list[str]:
    """Texts of a legend, which must be there."""
    assert legend is not None
    return [text.get_text() for text in legend.get_texts()]


def check_axes(draw: Draw, folder: Path) -> None:
    """Labels have units, and an axis with numbers or names has a label, its own or one that panels share."""
    figure = draw(folder)
    figure.draw_without_rendering()
    unlabelled = 0
    for axes in figure.axes:
        for axis, shared in ((axes.xaxis, figure.get_supxlabel()), (axes.yaxis, figure.get_supylabel())):
            shows = axes.axison and any(t.get_visible() and t.get_text() for t in axis.get_ticklabels())
            if text := axis.get_label_text() or (shared if shows else ""):
                is_title = axis is axes.yaxis and draw.__name__ == "network_inputs"
                assert is_title or text.partition(";")[0].endswith(")"), f"{text!r} has no unit"
                assert is_title or "(" in text, f"{text!r} has no unit"
            else:
                unlabelled += shows
    assert unlabelled == UNLABELLED.get(draw.__name__, 0)


def check_caption(draw: Draw) -> None:
    """A sentence, and a note that explains."""
    caption, _, note = (draw.__doc__ or "").strip().partition("\n\n")
    assert caption.endswith(".") and ". " not in caption
    assert len(note) > 80 and len(note.split()) > 10


def check_file(draw: Draw, folder: Path, out: Path) -> None:
    """Small, and the same every time."""
    paths = [out / "one.svg", out / "two.svg"]
    for path in paths:
        save(draw(folder), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert paths[0].stat().st_size < 1_000_000


def check_rendered(draw: Draw, folder: Path) -> Figure:
    """The figure of a folder, which can be written as SVG."""
    return rendered(draw(folder))


def rendered(figure: Figure) -> Figure:
    """The figure, which can be written as SVG."""
    save(figure, image := io.BytesIO())
    assert b"</svg>" in image.getvalue()
    return figure
