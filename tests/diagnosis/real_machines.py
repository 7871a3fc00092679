"""Diagnose converted measured machines again and print one line each, to compare a change before and after.

    python -m tests.diagnosis.real_machines <folder> [names]

`folder` holds <machine>/logs, as `acquire source=<machine>` writes them; names are machines, default: all.
"""

import sys
import time
from pathlib import Path

from pipeline.chapters.known import SUFFIX, read_machines, system_files
from pipeline.chapters.real import judged, said
from unmodelled.diagnosis.answer.diagnose import findings
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system


def main(folder: Path, names: list[str]) -> None:
    for machine in read_machines(Path("systems")):
        if (names and machine.name not in names) or not (folder / machine.name / "logs").exists():
            continue
        for file in system_files(Path("systems") / machine.name):
            start, system = time.perf_counter(), read_system(file)
            logs = read_logs(folder / machine.name / "logs", system)
            report = findings(system, logs).content
            gap, case = report["gap"], machine.cases[file.stem.removesuffix(SUFFIX)]
            gaps = ", ".join(f"{gap[name]:.3g}" for name in ("reidentified", "augmented", "floor"))
            fault = judged(case, report)["failed at"] or "holds"
            seconds = time.perf_counter() - start
            answer = f"{report['verdict']}: {said(report)}; gap {gaps}; {fault}; {seconds:.0f} s"
            print(f"{machine.name}/{file.stem}: {answer}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
