"""Look at a recorder's files, and write a first mapping and a first system file for them."""

from __future__ import annotations

import os
import re
from pathlib import Path

from unmodelled.base.errors import BadInput, printable
from unmodelled.base.files import replacing
from unmodelled.base.ownership import Out, verb
from unmodelled.cli.overrides import quoted
from unmodelled.drafting.draft import draft_of
from unmodelled.drafting.mapping_text import mapping_text
from unmodelled.drafting.robot_text import robot_system_text, with_goals
from unmodelled.drafting.system_text import system_text
from unmodelled.drafting.table_text import table_text
from unmodelled.logs.mapping import MAPPING
from unmodelled.systems.robot.files import robot_text


@verb(Out.SHARED, inside=["logs"], beside=["logs"])
def init(logs: Path, robot: Path | None, system: Path | None, out: Path | None) -> None:
    """Write mapping.yaml, which says which columns are the signals, and a system file that can be simulated.

    The columns are recognised by their names and units, and by their values: the speed is what agrees with
    the slope of a position, the drive is what explains its acceleration. The system file has one inertia or
    mass per position that moves, or, where none moves, one store per level (temperature, level, pressure,
    charge, speed), with a port; `simulate` runs with both files at once. Whatever was guessed stands beside a
    comment that begins with "Question". A table of the columns is printed.

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
    if out is not None and out.suffix in (".yaml", ".yml"):
        raise BadInput(f"out={out}: must be a folder, in which {MAPPING} is written")
    folder = logs if logs.is_dir() else logs.parent
    place = out or folder
    mapping, file = place / MAPPING, system or place / "system.yaml"
    if out is None and logs.is_dir() and (logs / "experiments.csv").exists():
        raise BadInput(f"{logs}: is a log folder already (experiments.csv): write the system file by hand")
    copies = {} if robot is None else _copies(robot, file.parent)
    for path in (mapping, file, *copies):
        if path.exists():
            raise BadInput(f"{path}: exists, and is not overwritten: remove it, or give another out=...")
    found = draft_of(logs) if robot is None else with_goals(draft_of(logs), robot)
    seen = Path(os.path.relpath(found.survey.folder.resolve(), place.resolve())).as_posix()
    name = logs.resolve().stem
    texts = {
        mapping: mapping_text(found, seen),
        file: system_text(found, name) if robot is None else robot_system_text(found, robot, name),
        **copies,
    }
    print(table_text(found))
    for path, text in texts.items():
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    given = mapping if (place / "experiments.csv").exists() else place
    print(printable(f"questions: {mapping} and {file}, behind 'Question'"))
    print(printable(f"next: unmodelled simulate {_key('system', file)} {_key('logs', given)} out=simulation"))


def _key(name: str, path: Path) -> str:
    """A word of the next command: plain, or in quotes."""
    plain = re.fullmatch(r"[\w./~-]+", str(path), re.ASCII)
    return f"{name}={path}" if plain else quoted(name, str(path))


def _copies(robot: Path, folder: Path) -> dict[Path, str]:
    """The robot file as text by its path beside the system file; none if it is there already."""
    path = folder / robot.name
    return {} if path.exists() and path.samefile(robot) else {path: robot_text(robot)}
