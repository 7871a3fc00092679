"""Where the gap between a system file and measured experiments lies, and which effect causes it."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from pipeline.diagnosis.augmented import FILE, write_augmented
from pipeline.diagnosis.checks import check, check_seed
from pipeline.diagnosis.diagnosed import diagnosed
from pipeline.diagnosis.diagnosis import Diagnosis
from pipeline.diagnosis.figure_tables import write_tables
from pipeline.diagnosis.sentences import sentences
from pipeline.diagnosis.summary import summary
from pipeline.diagnosis.where import where
from pipeline.figures.diagnosis.files import write_figures
from pipeline.files import check_replaceable, replacing_folder, write_json
from pipeline.measurements.folder import read_logs
from pipeline.physics.system.reader import read_system
from pipeline.progress import say
from pipeline.report.diagnosis_page import PAGE, write_page

SUMMARY = "diagnosis.json"
OURS = (SUMMARY, FILE, f"{Path(FILE).stem}_*.csv", "tables", "figures", PAGE)


def diagnose(system: Path, logs: Path, out: Path, horizon: float = 0.1, seed: int = 0) -> None:
    """Say which unmodelled effects explain the gap, and by how much it shrinks with them.

    `out` gets `diagnosis.json` (verdict, effects with numbers and intervals, where the gap lies, what was
    tried), `augmented_system.yaml` (the system with the identified laws; `simulate` takes it with the same
    logs), `figures`, the `tables` they are made from, and `index.html`, a page with all of it.

    Args:
        system: file of the known physics (system/1); parameters marked `identify` are refitted.
        logs: folder of the measured experiments, two or more; some are held out to judge by.
        out: folder, replaced as a whole; refused if it holds anything else.
        horizon: of the free-run windows, s.
        seed: of everything random; the same seed gives the same files.

    Raises:
        BadInput: when the system file, the logs, the horizon or the seed cannot be used.
    """
    system, logs, out = Path(system), Path(logs), Path(out)
    check_replaceable(out, OURS)
    check_seed(seed)
    known = read_system(system)
    measured = read_logs(logs, known)
    check(system, known, logs, measured, horizon)
    found = diagnosed(known, measured, horizon, seed, workers=os.cpu_count() or 1, progress=say)
    place = where(found)
    with replacing_folder(out) as folder:
        found = _with_augmented(found, folder)
        write_json(folder / SUMMARY, summary(found, place))
        write_tables(found, place, folder)
        write_figures(folder)
        write_page(folder, f"python -m pipeline diagnose {system=!s} {logs=!s} {horizon=} {seed=}")
    print("\n".join(sentences(found)))


def _with_augmented(found: Diagnosis, folder: Path) -> Diagnosis:
    """Write the augmented system, or note why there is none: not every expression has a form in a file."""
    try:
        write_augmented(found, folder)
    except ValueError as reason:
        return replace(found, notes=(*found.notes, f"{FILE} was not written: {reason}"))
    return found
