"""Search of folders that ends: it stops after a number of files and folders, and after a time."""

from __future__ import annotations

import fnmatch
import glob
import os
import re
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from unmodelled.base.errors import BadInput

#: Files and folders that a search looks at, at most, and its longest time, s: enough for any campaign, and
#: less than a whole machine.
ENTRIES, SECONDS = 500_000, 20.0


class Search:
    """Search with a limit on the files and folders that it looks at.

    `wrong` makes the error of a search beyond the limit from the end of its message.
    """

    def __init__(self, wrong: Callable[[str], BadInput]) -> None:
        self._wrong, self._seen, self._end = wrong, 0, time.monotonic() + SECONDS

    def matches(self, folder: Path, pattern: str) -> list[Path]:
        """Return the files and folders that a pattern matches, seen from a folder, as `glob.glob` does."""
        *parts, last = re.sub(r"(\*\*/+)+", "**/", pattern).split("/")
        start = "/" if pattern.startswith("/") else str(folder)
        found = [start]
        for part in filter(None, parts):
            found = [path for path in self._step(found, part) if os.path.isdir(path)]  # noqa: PTH112
        return [Path(path) for path in (self._step(found, last) if last else found) if path != start]

    def below(self, folder: Path, hidden: bool = True) -> Iterator[Path]:
        """Yield all files and folders below a folder; links to folders are not followed.

        `hidden`: whether hidden folders are looked through.
        """

        def enters(entry: os.DirEntry[str]) -> bool:
            return not entry.is_symlink() and (hidden or not entry.name.startswith("."))

        return (Path(entry.path) for entry in self._below(str(folder), enters))

    def _step(self, places: list[str], part: str) -> list[str]:
        """Paths that a part of a pattern matches in some folders, each once."""
        if part == "**":
            below = (entry for place in places for entry in self._below(place, _is_shown))
            inside = (entry.path for entry in below if not entry.name.startswith("."))
            return list(dict.fromkeys([*places, *inside]))
        if not glob.has_magic(part):
            paths = (os.path.join(place, part) for place in places)  # noqa: PTH118
            return list(dict.fromkeys(path for path in paths if os.path.lexists(path)))
        matches, hidden = re.compile(fnmatch.translate(part)).match, part.startswith(".")
        entries = (entry for place in places for entry in self._entries(place))
        return [e.path for e in entries if matches(e.name) and (hidden or not e.name.startswith("."))]

    def _below(self, folder: str, enters: Callable[[os.DirEntry[str]], bool]) -> Iterator[os.DirEntry[str]]:
        """Entries of a folder, and of the folders among them that `enters` takes."""
        ahead = [folder]
        while ahead:
            for entry in self._entries(ahead.pop()):
                yield entry
                if _is_folder(entry) and enters(entry):
                    ahead.append(entry.path)

    def _entries(self, folder: str) -> list[os.DirEntry[str]]:
        """Entries of a folder; none of what cannot be read."""
        found: list[os.DirEntry[str]] = []
        with suppress(OSError), os.scandir(folder) as entries:
            for entry in entries:
                found.append(entry)
                self._seen += 1
                if self._seen > ENTRIES:
                    raise self._wrong(f"has more than {ENTRIES} files and folders to look through")
        if time.monotonic() > self._end:
            raise self._wrong(f"has more files and folders to look through than {SECONDS:g} s allow")
        return found


def _is_folder(entry: os.DirEntry[str]) -> bool:
    return entry.is_dir(follow_symlinks=False) or (entry.is_symlink() and os.path.isdir(entry.path))  # noqa: PTH112


def _is_shown(entry: os.DirEntry[str]) -> bool:
    """Whether a folder is not hidden, and no link to a folder that it lies in."""
    if entry.name.startswith(".") or not entry.is_symlink():
        return not entry.name.startswith(".")
    return not Path(entry.path).parent.resolve().is_relative_to(Path(entry.path).resolve())
