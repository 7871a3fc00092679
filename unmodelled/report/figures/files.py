"""Draw all figures of a diagnosis into files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from unmodelled.base.files import replacing, write_json
from unmodelled.report.figures import (
    candidates,
    correlations,
    evidence,
    experiments,
    residual,
    spectrum,
    steps,
    tables,
    trajectories,
)
from unmodelled.report.figures.style import save, verbatim

Draw = Callable[[Path], Figure]

#: In the order of the page.
FIGURES: Mapping[str, Draw] = {
    "gap": steps.gap_steps,
    "lacking": residual.lacking,
    "left_over": residual.left_over,
    "experiments": experiments.gaps_of_experiments,
    "before_and_after": trajectories.before_and_after,
    "spectrum": spectrum.spectrum,
    "correlations": correlations.correlations,
    "evidence": evidence.evidence,
    "candidates": candidates.candidates,
}

#: Those of logs that are to be checked, to which nothing was fitted.
UNFITTED: Mapping[str, Draw] = {
    "experiments": experiments.gaps_as_given,
    "before_and_after": trajectories.worst_as_given,
}


def write_figures(folder: Path) -> dict[str, Exception]:
    """Draw the figures of a diagnosis: SVG files, and figures.json with captions and notes.

    Without effects, the figure of the remaining residual is omitted, because it equals the residual
    before; without a gap, also that of the residual before, without two fitted numbers that of their
    correlations, and without laws that were compared by evidence that of their evidence. A figure that
    cannot be drawn is omitted; the other figures are drawn. A diagnosis that asks to check the logs has
    two figures.
    """
    chosen = figures_of(folder)
    faults: dict[str, Exception] = {}
    for name, draw in chosen.items():
        try:
            with verbatim(), replacing(folder / "figures" / f"{name}.svg") as temporary:
                save(draw(folder), temporary)
        except Exception as fault:
            faults[name] = fault
    drawn = {name: draw for name, draw in chosen.items() if name not in faults}
    entries = [_entry(name, number, draw) for number, (name, draw) in enumerate(drawn.items(), start=1)]
    write_json(folder / "figures" / "figures.json", entries)
    return {f"figures/{name}.svg": fault for name, fault in faults.items()}


def figures_of(folder: Path) -> Mapping[str, Draw]:
    """Return the figures of a diagnosis by name, in the order of the page."""
    about = tables.about(folder)
    figures = UNFITTED if about["verdict"] == "check_logs" else FIGURES
    absent = [] if about["effects"] else ["left_over"]
    if about["verdict"] == "no_gap":
        absent.append("lacking")
    shown_if = {"correlations": correlations.TABLE, "evidence": evidence.TABLE}
    absent += [name for name, table in shown_if.items() if not tables.exists(folder, table)]
    return {name: draw for name, draw in figures.items() if name not in absent}


def _entry(name: str, number: int, draw: Draw) -> dict[str, Any]:
    caption, _, note = (draw.__doc__ or "").strip().partition("\n\n")
    about = {"caption": " ".join(caption.split()), "note": " ".join(note.split())}
    return {"id": name, "number": str(number), "chapter": None, **about}
