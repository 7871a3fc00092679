"""Diagnose the same logs with every system file of a folder, without figures and pages."""

from __future__ import annotations

import hashlib
from functools import partial
from pathlib import Path

from pipeline.chapters.known import system_files
from pipeline.jobs import growing_folder, run_jobs
from pipeline.revision import PACKAGE
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing_folder
from unmodelled.base.ownership import verb
from unmodelled.diagnosis.answer.diagnose import findings
from unmodelled.diagnosis.answer.sentences import sentences
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system


@verb()
def diagnose_systems(
    systems: Path, logs: Path, horizon: float | None, seed: int, workers: int, out: Path
) -> None:
    """Write diagnosis.json, augmented_system.yaml and tables to `out`/<system file> for every system file.

    An interrupted run continues with the next system file, as long as system files, logs, arguments and
    program are the same.

    Args:
        systems: system file, or folder of system files that describe the same machine.
        logs: folder of the measured experiments, two or more.
        horizon: length of the free-run windows, s; null: from the logs.
        seed: seed of the random generators of a diagnosis.
        workers: number of processes, of one thread each; a single system file gets as many threads.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when there is no system file, or a system file or the logs cannot be used.
    """
    files = system_files(systems) if systems.is_dir() else [systems]
    if not files:
        raise BadInput(f"{systems}: holds no system file, <name>.yaml")
    about = {"systems": _digest(systems), "logs": _digest(logs), "horizon": horizon, "seed": seed}
    with growing_folder(out, about, [PACKAGE]) as folder:
        left = [file for file in files if not (folder / file.stem / "tables").exists()]
        threads = workers if len(left) == 1 else 1
        jobs = {f.name: partial(_diagnose, f, logs, horizon, seed, threads, folder / f.stem) for f in left}
        run_jobs(jobs, workers, "diagnosing")


def _diagnose(system: Path, logs: Path, horizon: float | None, seed: int, threads: int, out: Path) -> None:
    known = read_system(system)
    found = findings(known, read_logs(logs, known), horizon, seed, threads)
    with replacing_folder(out) as folder:
        content = found.write(folder)
    print(f"{system}:", *sentences(content), sep="\n")


def _digest(place: Path) -> str:
    """Digest a file, or all files of a folder that are not hidden."""
    files = sorted(p for p in place.rglob("[!.]*") if p.is_file()) if place.is_dir() else [place]
    digest = hashlib.sha256()
    for file in files:
        if not file.exists():
            raise BadInput(f"{file}: no such file")
        digest.update(f"{file.name} {file.stat().st_size} ".encode() + file.read_bytes())
    return digest.hexdigest()
