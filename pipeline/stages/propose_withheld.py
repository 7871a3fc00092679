"""Measure one more experiment on withheld cases: a proposed one, a chirp and random levels."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from pipeline.chapters.reported import read_truth
from pipeline.jobs import growing_folder, run_jobs
from pipeline.revision import PACKAGE
from pipeline.rigs.withheld.campaign import add_runs
from pipeline.rigs.withheld.cases import Case
from pipeline.withheld.folders import LOGS, PROVENANCE, SYSTEM, TRUTH, cases_in
from pipeline.withheld.proposals import KINDS, write_limits
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json, write_json
from unmodelled.base.ownership import verb
from unmodelled.design.design import design
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

#: Of `out`: which experiments were measured on every case, and why none was.
NOTES = "notes"


@verb()
def propose_withheld(cases: Path, diagnoses: Path, repeats: int, seed: int, workers: int, out: Path) -> None:
    """Write `out`/proposed, `out`/chirp and `out`/random: the cases with one more experiment in their logs.

    The experiment is designed from the diagnosis of the case, within the ranges of its logs, and the virtual
    machine of the case runs it. The chirp and the random levels have the same length and limits. A case is
    missing where no experiment can be designed, as where the diagnosis asks to check the logs, or where every
    chirp leaves the limits; `out`/notes says so. Diagnose `out` with `diagnose_withheld`.

    Args:
        cases: campaign of withheld cases, as `acquire source=withheld` writes it.
        diagnoses: folder of the diagnoses of this campaign, written by `diagnose_withheld`.
        repeats: number of times that the experiment is measured.
        seed: seed of the search for the experiment.
        workers: number of processes.
        out: folder that is new, empty or was made by this verb; replaced as a whole once all cases are done.

    Raises:
        BadInput: when a case has no diagnosis, or cannot be used.
    """
    origin = read_json(cases / PROVENANCE)
    answers = {case: read_json(diagnoses / f"{case.name}.json") for case in cases_in(cases)}
    about = {"cases": origin, "repeats": repeats, "seed": seed}
    with growing_folder(out, about, [PACKAGE]) as folder:
        for kind in KINDS:
            (folder / kind).mkdir(exist_ok=True)
            write_json(folder / kind / PROVENANCE, origin)
        jobs = {
            case.name: partial(_propose, case, answer, repeats, seed, folder)
            for case, answer in answers.items()
            if not (folder / NOTES / f"{case.name}.json").exists()
        }
        run_jobs(jobs, workers, "proposing")


def _propose(case: Path, answer: dict[str, Any], repeats: int, seed: int, folder: Path) -> None:
    system = read_system(case / SYSTEM)
    logs, truth = read_logs(case / LOGS, system), Case.of(read_truth(case / TRUTH))
    found: dict[str, Any] = {}
    why = ""
    with TemporaryDirectory() as made:
        write_limits(system, logs, limits := Path(made) / "limits.yaml")
        try:
            best = design(system, logs, answer, limits, seed)
            found = {KINDS[0]: best.found.u, **best.references}
        except BadInput as error:
            why = str(error).replace(made, case.name)
    measured = {kind: u for kind, u in found.items() if u is not None}
    for kind, u in measured.items():
        new = folder / kind / case.name
        copytree(case, new, dirs_exist_ok=True)
        add_runs(truth, np.repeat(u, repeats, axis=1), new / LOGS)
    write_json(folder / NOTES / f"{case.name}.json", {"measured": list(measured), "why": why})
