"""Where the gap between a system file and measured experiments lies, and which effect causes it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder, write_json
from unmodelled.base.ownership import verb
from unmodelled.base.progress import say
from unmodelled.diagnosis.answer.augmented import FILE, write_augmented
from unmodelled.diagnosis.answer.diagnose_gap import diagnose_gap
from unmodelled.diagnosis.answer.figure_tables import write_tables
from unmodelled.diagnosis.answer.sentences import sentences
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.answer.whole_runs import whole_run_notes
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.fitting.checks import check, check_seed, check_windows
from unmodelled.diagnosis.search.log_faults import log_faults
from unmodelled.diagnosis.where.where import Where, where
from unmodelled.logs.folder import read_logs
from unmodelled.report.diagnosis_page import PAGE, write_page
from unmodelled.report.figures.files import write_figures
from unmodelled.systems.reader import read_system

SUMMARY = "diagnosis.json"


@verb()
def diagnose(system: Path, logs: Path, out: Path, horizon: float = 0.1, seed: int = 0) -> None:
    """Say which unmodelled effects explain the gap, and by how much it shrinks with them.

    `out` gets `diagnosis.json` (verdict, effects with numbers and intervals, where the gap lies, what was
    tried), `augmented_system.yaml` (the system with the identified laws; `simulate` takes it with the same
    logs), `figures`, the `tables` they are made from, and `index.html`, a page with all of it. The answer is
    written first: what cannot be drawn is a note in it. Where a fault of the logs, such as a unit or a sign,
    explains most of the gap, that is the answer (verdict check_logs) and no effect is searched.

    Args:
        system: file of the known physics (system/1); parameters marked `identify` are refitted.
        logs: folder of the measured experiments, two or more; some are held out to judge by.
        out: folder that is new, empty or was made by this verb; replaced as a whole.
        horizon: of the free-run windows, s.
        seed: of everything random; the same seed gives the same files.

    Raises:
        BadInput: when the system file, the logs, the horizon or the seed cannot be used.
    """
    system, logs, out = Path(system), Path(logs), Path(out)
    check_seed(seed)
    known = read_system(system)
    measured = read_logs(logs, known)
    check(system, known, logs, measured, horizon)
    faults = log_faults(known, measured, horizon)
    if not any(fault.decides for fault in faults):
        check_windows(system, known, measured, horizon)
    workers = os.cpu_count() or 1
    found = diagnose_gap(known, measured, horizon, seed, workers=workers, progress=say, faults=faults)
    place = where(found)
    with replacing_folder(out) as folder:
        if found.verdict != "check_logs":
            found = _with_augmented(found, folder)
        write_json(folder / SUMMARY, summary(found, place))
    # the answer is safe from here on, whatever becomes of the pictures
    command = f"unmodelled diagnose {system=!s} {logs=!s} {horizon=} {seed=}"
    with replacing_folder(out) as folder:
        shutil.copytree(out, folder, ignore=shutil.ignore_patterns(".*"), dirs_exist_ok=True)
        found = _shown(found, place, folder, command)
    print("\n".join(sentences(found)))


def _with_augmented(found: Diagnosis, folder: Path) -> Diagnosis:
    """Write the augmented system and simulate whole experiments with it, or note why that cannot be done."""
    try:
        write_augmented(found, folder)
    except ValueError as reason:  # not every expression has a form in a file
        return _with_notes(found, f"{FILE} was not written: {reason}")
    try:
        return _with_notes(found, *whole_run_notes(found, folder / FILE))
    except Exception as fault:
        return _with_notes(found, _note(f"{FILE}: whole experiments could not be simulated", fault))


def _shown(found: Diagnosis, place: Where, out: Path, command: str) -> Diagnosis:
    """Put tables, figures and the page beside the answer in a folder; note there what cannot be made."""
    parts: Mapping[str, Callable[[], Mapping[str, Exception] | None]] = {
        "tables": lambda: write_tables(found, place, out),
        "figures": lambda: write_figures(out),
        PAGE: lambda: write_page(out, command),
    }
    for name, write in parts.items():
        try:
            faults = write() or {}
        except Exception as fault:
            faults = {name: fault}
        if faults:
            notes = (_note(f"{part} could not be made", fault) for part, fault in faults.items())
            found = _with_notes(found, *notes)
            with suppress(BadInput):  # a full disk: the answer stays as it was, the terminal has the notes
                write_json(out / SUMMARY, summary(found, place))
        if name in faults:  # the other parts are made from this one
            break
    return found


def _note(what: str, fault: Exception) -> str:
    reason = str(fault) if isinstance(fault, BadInput) else f"{type(fault).__name__}: {fault}"
    return f"{what} ({BadInput(reason)}); {SUMMARY} has all numbers. Please report this line"


def _with_notes(found: Diagnosis, *notes: str) -> Diagnosis:
    return replace(found, notes=(*found.notes, *notes))
