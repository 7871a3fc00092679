"""Refit withheld cases with their planted effects known, as a reference for the diagnosis."""

from __future__ import annotations

from dataclasses import asdict
from functools import partial
from pathlib import Path

from pipeline.chapters.reported import read_held_out, read_truth
from pipeline.jobs import growing_folder, run_jobs
from pipeline.revision import PACKAGE
from pipeline.withheld.folders import LOGS, PROVENANCE, SYSTEM, TRUTH, campaigns_in, cases_in
from pipeline.withheld.oracle import Known, oracle
from pipeline.withheld.sparse_regression import largest_term
from unmodelled.base.files import read_json, write_json
from unmodelled.base.ownership import verb
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system


@verb()
def refit_withheld(cases: Path, diagnoses: Path, horizon: float | None, workers: int, out: Path) -> None:
    """Write `out`/<campaign>/<case>.json: `oracle` (see `pipeline.withheld.oracle`) and `sparse_regression`.

    The oracle knows the families and channels of the planted effects. Both methods use the training
    experiments of the diagnosis, and the oracle is assessed on its held-out experiments. An interrupted run
    continues with the next case, as long as cases, diagnoses, arguments and program are the same.

    Args:
        cases: folder of campaigns of withheld cases.
        diagnoses: folder written by diagnose_withheld, with <campaign>/<case>.json.
        horizon: length of the free-run windows, s; null: from the logs of every case.
        workers: number of processes, of one thread each.
        out: folder that is new, empty or was made by this verb; replaced as a whole once all cases are done.

    Raises:
        BadInput: when a case has no diagnosis, or cannot be used.
    """
    folders = [case for campaign in campaigns_in(cases) for case in cases_in(campaign)]
    names = [case.relative_to(cases).as_posix() for case in folders]
    held_out = {name: read_held_out(diagnoses / f"{name}.json") for name in names}
    origins = [read_json(campaign / PROVENANCE) for campaign in campaigns_in(cases)]
    about = {"cases": origins, "held_out": held_out, "horizon": horizon}
    with growing_folder(out, about, [PACKAGE]) as folder:
        jobs = {
            name: partial(_refit, case, held_out[name], horizon, folder / f"{name}.json")
            for name, case in zip(names, folders, strict=True)
            if not (folder / f"{name}.json").exists()
        }
        run_jobs(jobs, workers, "refitting")


def _refit(case: Path, held_out: list[str], horizon: float | None, path: Path) -> None:
    system = read_system(case / SYSTEM)
    logs = read_logs(case / LOGS, system)
    seconds = horizon_of(logs, horizon)
    study = Study(system, logs, seconds, tuple(logs.ids.index(name) for name in held_out))
    if not study.learned:  # each was left out once: a share of them judges the references
        study = Study.of(system, logs, seconds, 0)
    planted = [
        Known(row["family"], row["channel"], row.get("factor"), row.get("level"))
        for row in read_truth(case / TRUTH)["effects"]
    ]
    best, term = oracle(study, planted), largest_term(study)
    content = {
        "oracle": {**asdict(best), "shrink": best.shrink},
        "sparse_regression": None if term is None else asdict(term),
    }
    write_json(path, content)
