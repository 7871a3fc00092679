"""Read the list of the figures in a folder."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from unmodelled.base.errors import BadInput
from unmodelled.report.checks import check_chapter, read_rows


@dataclass(frozen=True)
class Figure:
    """A numbered SVG file and its description."""

    id: str  # name of the file without suffix, and anchor on a page
    number: str
    chapter: int | None  # of the dissertation
    caption: str
    note: str  # text below the caption
    command: str  # that draws the figure
    data: str  # measured, virtual or both; empty if unknown
    source: Path  # the SVG file
    size: tuple[int, int] | None  # width and height, px; None if the file does not tell


def read_figures(folder: Path) -> list[Figure]:
    """Read the list of figures in figures.json, sorted by chapter and number."""
    path = folder / "figures.json"
    found = []
    for row in read_rows(path, ("id", "number", "chapter", "caption")):
        if not re.fullmatch(r"\w+", str(row["id"])):
            raise BadInput(f"{path}: id {row['id']!r}, must be letters, digits and underscores")
        source = folder / f"{row['id']}.svg"
        if not source.exists():
            raise BadInput(f"{source}: no such file, but {path} lists it")
        check_chapter(path, f"figure {row['id']!r}:", row["chapter"])
        caption, note, command, data = (str(row.get(k) or "") for k in ("caption", "note", "command", "data"))
        about = (str(row["number"]), row["chapter"], caption, note, command, data)
        found.append(Figure(row["id"], *about, source, _size(source)))
    return sorted(found, key=lambda f: (f.chapter or 0, [int(n) for n in re.findall(r"\d+", f.number)], f.id))


def _size(path: Path) -> tuple[int, int] | None:
    """Width and height, so that a page does not move while its figures load."""
    box = re.search(rb'<svg[^>]*viewBox="[\d.-]+ [\d.-]+ ([\d.]+) ([\d.]+)"', path.read_bytes()[:4000])
    # figures are drawn in points, 72 to the inch; a browser has 96 pixels there
    return (round(float(box[1]) * 96 / 72), round(float(box[2]) * 96 / 72)) if box else None
