"""Diagnose many virtual machines whose planted effects are withheld."""

from __future__ import annotations

import resource
import sys
import time
from functools import partial
from pathlib import Path

from pipeline.jobs import growing_folder, run_jobs
from pipeline.revision import PACKAGE
from pipeline.withheld.folders import COSTS, LOGS, PROVENANCE, SYSTEM, VALIDATION, campaigns_in, cases_in
from pipeline.withheld.validation import validated
from unmodelled.base.files import read_json, write_json
from unmodelled.base.ownership import verb
from unmodelled.base.progress import say
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.persistence import horizon_of
from unmodelled.diagnosis.where.where import where
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system


@verb()
def diagnose_withheld(cases: Path, horizon: float | None, seed: int, workers: int, out: Path) -> None:
    """Write `out`/<case>.json, the diagnosis (diagnosis/2), and `out`/costs/<case>.json.

    For several campaigns, these files are `out`/<campaign>/<case>.json and
    `out`/<campaign>/costs/<case>.json.

    A diagnosis reads only system.yaml and logs/ of its case. If the case has validation/, then
    `out`/validation/<case>.json contains the errors of the diagnosed models on these experiments.

    `costs` contain the duration (s) and the largest memory (MB) of the process so far. An interrupted run
    continues with the next case, as long as cases, arguments and program are the same.

    Args:
        cases: folder of one campaign of withheld cases, as acquire writes it, or of several such campaigns.
        horizon: length of the free-run windows, s; null: from the logs of every case.
        seed: seed of all random numbers of a diagnosis.
        workers: number of processes, of one thread each; a single case gets as many threads.
        out: folder that is new, empty or was made by this verb; replaced as a whole once all cases are done.

    Raises:
        BadInput: when there are no cases, or one of them cannot be used.
    """
    campaigns = [cases] if (cases / PROVENANCE).exists() else campaigns_in(cases)
    folders = [case for campaign in campaigns for case in cases_in(campaign)]
    about = {"cases": [read_json(c / PROVENANCE) for c in campaigns], "horizon": horizon, "seed": seed}
    with growing_folder(out, about, [PACKAGE]) as folder:
        answers = {case: folder / case.relative_to(cases).with_suffix(".json") for case in folders}
        left = [case for case in folders if not answers[case].exists()]
        threads = workers if len(left) == 1 else 1
        jobs = {str(case): partial(_diagnose, case, horizon, seed, threads, answers[case]) for case in left}
        say(f"diagnosing {len(left)} of {len(folders)} cases")
        run_jobs(jobs, workers, "diagnosing")


def _diagnose(case: Path, horizon: float | None, seed: int, threads: int, out: Path) -> None:
    start = time.monotonic()
    known = read_system(case / SYSTEM)
    logs = read_logs(case / LOGS, known)
    seconds = horizon_of(logs, horizon)
    found = diagnose_gap(known, logs, seconds, seed, workers=threads)
    content = summary(found, where(found))
    cost = {"seconds": time.monotonic() - start, "memory": _memory()}
    write_json(out.parent / COSTS / out.name, cost)
    if (case / VALIDATION).exists():
        write_json(out.parent / VALIDATION / out.name, validated(found, case / VALIDATION))
    write_json(out, content)  # last: it says that the case is done


def _memory() -> float:
    """Return the largest memory of this process so far, MB."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
