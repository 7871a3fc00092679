"""All figures of a diagnosis as files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pipeline.figures.diagnosis import candidates, experiments, residual, steps, tables, trajectories
from pipeline.figures.style import save
from pipeline.files import replacing, write_json

Draw = Callable[[Path], Figure]

#: In the order of the page.
FIGURES: Mapping[str, Draw] = {
    "gap": steps.gap_steps,
    "lacking": residual.lacking,
    "left_over": residual.left_over,
    "experiments": experiments.gaps_of_experiments,
    "before_and_after": trajectories.before_and_after,
    "candidates": candidates.candidates,
}


def write_figures(folder: Path) -> None:
    """Write `folder`/figures from `folder`/tables: SVG files, and figures.json with captions and notes.

    What is left is not drawn where no effect was found: it is what was lacking.

    Raises:
        BadInput: when a file cannot be written.
        FileNotFoundError: when a table is missing.
    """
    found = bool(tables.about(folder)["effects"])
    chosen = {name: draw for name, draw in FIGURES.items() if found or name != "left_over"}
    for name, draw in chosen.items():
        with replacing(folder / "figures" / f"{name}.svg") as temporary:
            save(draw(folder), temporary)
    entries = [_entry(name, number, draw) for number, (name, draw) in enumerate(chosen.items(), start=1)]
    write_json(folder / "figures" / "figures.json", entries)


def _entry(name: str, number: int, draw: Draw) -> dict[str, Any]:
    caption, _, note = (draw.__doc__ or "").strip().partition("\n\n")
    about = {"caption": " ".join(caption.split()), "note": " ".join(note.split())}
    return {"id": name, "number": str(number), "chapter": None, **about}
