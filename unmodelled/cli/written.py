"""Name the files that a verb has written, and the command that opens them."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput, first_few
from unmodelled.base.search import Search

#: Arguments that name what a verb writes.
RESULTS = ("out", "reports")
#: Names of files that the line shows.
NAMES = 6
#: Command that opens a file, by pattern of its name; of several files, the first pattern counts.
VIEWS = (
    ("index.html", "open {}"),
    ("*.svg", "open {}"),
    ("*.md", "read {}"),
    ("*.csv", "read {}"),
    ("*.parquet", "read {} with pandas.read_parquet"),
    ("*.json", "read {}"),
)


def written(program: str, verb: str, arguments: Mapping[str, Any], since: float, hints: bool = True) -> str:
    """Return the line that names the files of a verb and the command that opens them."""
    places = [_near(Path(str(arguments[name]))) for name in RESULTS if arguments.get(name) is not None]
    found = {place: files for place in places if (files := _entries(place, since))}
    if not found:
        return ""
    parts = [f"{place}: {_listed(files)}" if place.is_dir() else str(place) for place, files in found.items()]
    if not hints:
        return f"wrote {', '.join(map(str, found))}"
    view = _view([file for files in found.values() for file in files])
    following = str(getattr(sys.modules.get(verb), "NEXT", "")).format_map({**arguments, "program": program})
    return "; ".join([f"wrote {', '.join(parts)}", *(step for step in (view, following) if step)])


def _near(path: Path) -> Path:
    """Return a path as a user in the working directory would write it."""
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def _entries(place: Path, since: float) -> list[Path]:
    """The files and folders in `place` that are not hidden; only what is new, where something is."""
    if place.is_file():
        return [place]
    entries = sorted(path for path in place.glob("*") if not path.name.startswith("."))
    search = Search(lambda why: BadInput(f"{place}: {why}"))
    with suppress(BadInput):  # the files are written, and too many lie beside them to tell which are new
        return [path for path in entries if _is_new(path, since, search)] or entries
    return entries


def _is_new(path: Path, since: float, search: Search) -> bool:
    try:
        inside = search.below(path) if path.is_dir() else ()
        return any(file.lstat().st_mtime >= since for file in chain([path], inside))
    except OSError:  # another stage has just replaced it
        return False


def _listed(files: list[Path]) -> str:
    return first_few([file.name + ("/" if file.is_dir() else "") for file in files], NAMES)


def _view(files: list[Path]) -> str:
    for pattern, how in VIEWS:
        for file in files:
            if file.match(pattern):
                return how.format(file)
    return ""
