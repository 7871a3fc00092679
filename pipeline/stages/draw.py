"""Draw the figures of every chapter from the tables."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.jobs import run_jobs
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.ownership import verb
from unmodelled.base.shapes import ORIGIN, read_shaped

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@verb(inside=["data"])
def draw(
    figures: Mapping[str, Callable[[Path], Figure]],
    only: list[str] | None,
    data: Path,
    raw: Path,
    campaigns: Mapping[str, str],
    workers: int,
    out: Path,
) -> None:
    """Write `out`/<name>.svg for every figure and `out`/figures.json with their captions.

    Args:
        figures: function of the data folder by name (fig_<number> with underscores). The number begins with
            the chapter, or with a letter if the figure belongs to no chapter.
        only: names of the figures to draw; null or empty: all figures.
        data: folder with the tables.
        raw: folder with <campaign>/provenance.json.
        campaigns: campaign that the figures of a chapter or letter show.
        workers: number of processes that draw.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when a name is unknown, or a table is missing.
    """
    unknown = sorted(set(only or ()) - set(figures))
    if unknown:
        raise BadInput(f"unknown figure {unknown[0]}, must be one of {', '.join(figures)}")
    chosen = {name: f for name, f in figures.items() if not only or name in only}
    index = []
    with replacing_folder(out) as folder:
        jobs = {
            name: functools.partial(_draw, name, function, data, folder / f"{name}.svg")
            for name, function in chosen.items()
        }
        run_jobs(jobs, workers, "drawing")
        for name, function in chosen.items():
            entry = _entry(name, function)
            first = entry["number"].split(".")[0]
            origin = read_shaped(raw / campaigns[first] / "provenance.json", ORIGIN)
            index.append({**entry, "data": origin["data"]})
        write_json(folder / "figures.json", index)


def _draw(name: str, function: Callable[[Path], Figure], data: Path, out: Path) -> None:
    from unmodelled.report.figures.style import save, style

    try:
        with style():
            figure = function(data)
    except BadInput as error:
        raise BadInput(f"{name}: {error}") from None
    save(figure, out)


def _entry(name: str, function: Callable[[Path], Figure]) -> dict[str, Any]:
    number = name.removeprefix("fig_").replace("_", ".")
    inner = function.func if isinstance(function, functools.partial) else function
    caption, _, note = (inner.__doc__ or "").strip().partition("\n\n")
    first = number.split(".")[0]
    return {
        "id": name,
        "number": number,
        "chapter": int(first) if first.isdigit() else None,
        "caption": " ".join(caption.split()),
        "note": " ".join(note.split("Args:")[0].split()),
        "command": f"python -m pipeline draw 'only=[{name}]'",
    }
