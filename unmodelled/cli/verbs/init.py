"""Look at a recorder's files, and write a first mapping and a first system file for them."""

from __future__ import annotations

import re
from pathlib import Path

from unmodelled.base.errors import printable
from unmodelled.base.files import write_texts
from unmodelled.base.ownership import Out, verb
from unmodelled.cli.overrides import quoted


@verb(Out.SHARED, inside=["logs"], beside=["logs"])
def init(logs: Path, robot: Path | None, system: Path | None, out: Path | None) -> None:
    """Write mapping.yaml, which says which columns are the signals, and a system file that can be simulated.

    The columns are recognised by their names and units, and by their values: the speed is what agrees with
    the slope of a position, the drive is what explains its acceleration. The system file has one inertia or
    mass per position that moves, or, where none moves, one store per level (temperature, level, pressure,
    charge, speed), with a port; `simulate` runs with both files at once. Whatever was guessed stands beside a
    comment that begins with "Question", and a number that the logs cannot tell has `guess: true`. A table of
    the columns is printed.

    With a robot file, this file is the known physics instead, and a copy of it is put beside the system file.

    Args:
        logs: file of a recorder, or folder with such files, of any format that is read.
        robot: MJCF or URDF file of the robot; null: one inertia or mass per position.
        system: system file to write; null: system.yaml beside mapping.yaml.
        out: folder of mapping.yaml and of the system file, made if it is missing; null: that of the logs.

    Raises:
        BadInput: when no file can be read, no moving position or level is found, the folder is a log folder
            already, one of the files exists (no file is overwritten), or the robot file does not fit the
            logs.
    """
    # what takes seconds to load, after the checks of `verb`
    from unmodelled.drafting.first_files import first_files

    found = first_files(logs, robot, system, out)
    print(found.table)
    write_texts(found.texts)
    print(printable(f"questions: {found.mapping} and {found.system}, behind 'Question'"))
    given = f"{_key('system', found.system)} {_key('logs', found.logs)}"
    print(printable(f"next: unmodelled simulate {given} out=simulation"))


def _key(name: str, path: Path) -> str:
    """A word of the next command: plain, or in quotes."""
    plain = re.fullmatch(r"[\w./~-]+", str(path), re.ASCII)
    return f"{name}={path}" if plain else quoted(name, str(path))
