"""Look at a recorder's files, and write a first mapping and a first system file for them."""

from __future__ import annotations

import os
from pathlib import Path

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.base.ownership import Out, verb
from unmodelled.drafting.draft import draft_of
from unmodelled.drafting.mapping_text import mapping_text
from unmodelled.drafting.system_text import system_text
from unmodelled.drafting.table_text import table_text
from unmodelled.logs.mapping import MAPPING


@verb(Out.SHARED, inside=["logs"])
def init(logs: Path, system: Path | None, out: Path | None) -> None:
    """Write mapping.yaml, which says which columns are the signals, and a system file that can be simulated.

    The columns are recognised by their names and units, and by their values: the speed is what agrees with
    the slope of a position, the drive is what explains its acceleration. The system file has one inertia or
    mass per position that moves, with a port; `simulate` runs with both files at once. Whatever was guessed
    stands beside a comment that begins with "Question". A table of the columns is printed.

    Args:
        logs: file of a recorder, or folder with such files, of any format that is read.
        system: system file to write; null: system.yaml in `out`.
        out: folder of mapping.yaml; null: the folder of the logs.

    Raises:
        BadInput: when no file can be read, no moving position is found, the folder is a log folder already,
            or one of the two files exists: no file is overwritten.
    """
    folder = logs if logs.is_dir() else logs.parent
    place = out or folder
    mapping, model = place / MAPPING, system or place / "system.yaml"
    if out is None and logs.is_dir() and (logs / "experiments.csv").exists():
        raise BadInput(f"{logs}: is a log folder already (experiments.csv): write the system file by hand")
    for path in (mapping, model):
        if path.exists():
            raise BadInput(f"{path}: exists, and is not overwritten: remove it, or give another out=...")
    found = draft_of(logs)
    seen = Path(os.path.relpath(found.survey.folder.resolve(), place.resolve())).as_posix()
    texts = {
        mapping: mapping_text(found, seen),
        model: system_text(found, logs.resolve().stem),
    }
    print(table_text(found))
    for path, text in texts.items():
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    given = mapping if (place / "experiments.csv").exists() else place
    print(f"questions: {mapping} and {model}, behind 'Question'")
    print(f"next: unmodelled simulate system={model} logs={given} out=simulation")
