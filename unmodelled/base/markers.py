"""Markers of result folders: which verb made a folder, and which of its files are results."""

from __future__ import annotations

import json
import re
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.limits import OBJECTS, check_file
from unmodelled.base.search import Search

#: The file in a folder that says which verb made it, and which files the verb wrote if it replaces them all.
MARKER = ".made_by"
#: What Hydra and a sweep write about a run into the run's folder; it stays when the folder is replaced.
RECORD = ".hydra"
#: Name of a result, and of the process that is writing it, in what `files.hidden` calls it until it is whole.
ON_ITS_WAY = re.compile(r"\.([^/]+)\.(\d+)\.[0-9a-f]{8}\.tmp")
#: The same of a folder that grows over several runs.
GROWING = re.compile(r"\.[^/]+\.growing\.tmp")


def marker_text(content: Mapping[str, Any]) -> str:
    """Return the text of a marker."""
    return json.dumps(content, indent=1, sort_keys=True) + "\n"


def stamp(marker: Path) -> tuple[str, frozenset[str] | None] | None:
    """Return the verb and the listed files (None if none are listed) of a marker; None without a marker."""
    check_file(marker, OBJECTS)
    try:
        content = json.loads(marker.read_text()) if marker.is_file() else None
    except (OSError, ValueError, RecursionError):
        return None
    match content:
        case {"made_by": str(maker), "files": [*files]}:
            return maker, frozenset(map(str, files))
        case {"made_by": str(maker)}:
            return maker, None
    return None


def files_in(folder: Path) -> Iterator[str]:
    """Yield the files and links below a folder as relative paths, without the marker and `.hydra`."""
    search = Search(lambda why: BadInput(f"{folder}: {why}: give a folder that holds results alone"))
    for found in search.below(folder):
        own = found == folder / MARKER or folder / RECORD in found.parents
        if not own and (found.is_symlink() or not found.is_dir()):
            yield found.relative_to(folder).as_posix()


def links_in(folder: Path) -> list[str]:
    """Return the links below a folder as relative paths: they are no results; hidden ones are left out."""
    links = (name for name in files_in(folder) if (folder / name).is_symlink())
    return sorted(name for name in links if not any(part.startswith(".") for part in Path(name).parts))


def results_in(folder: Path) -> Iterator[str]:
    """Yield the results below a folder as relative paths: the files that its marker lists, if it lists some.

    Hidden files, links, pipes and devices are no results.
    """
    own = stamp(folder / MARKER)
    listed = None if own is None else own[1]
    for name in files_in(folder):
        if any(part.startswith(".") for part in Path(name).parts) or not (listed is None or name in listed):
            continue
        if stat.S_ISREG((folder / name).lstat().st_mode):
            yield name


def is_on_its_way(path: Path) -> bool:
    """Return whether `path` is, or lies inside, a temporary folder that is checked when it is renamed."""
    names = (path.name, *(parent.name for parent in path.absolute().parents))
    return any(ON_ITS_WAY.fullmatch(name) or GROWING.fullmatch(name) for name in names)
