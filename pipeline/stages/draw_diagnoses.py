"""Draw the figures of diagnoses from the tables of their answers."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from pipeline.jobs import run_jobs
from unmodelled.base.errors import BadInput
from unmodelled.base.files import copy_results, read_json, replacing_folder, write_json
from unmodelled.base.ownership import verb


@verb()
def draw_diagnoses(diagnoses: Path, workers: int, out: Path) -> None:
    """Write `out`/<diagnosis>: the answer with its tables, and figures that are drawn from them.

    Args:
        diagnoses: folder that is searched for diagnoses with tables.
        workers: number of processes that draw.
        out: folder that is new, empty or was made by this verb; replaced as a whole.

    Raises:
        BadInput: when a diagnosis is damaged, or a figure cannot be drawn.
    """
    found = [path.parents[1] for path in sorted(diagnoses.rglob("[!.]*/tables/about.json"))]
    with replacing_folder(out) as folder:
        jobs = {str(d): partial(_draw, d, folder / d.relative_to(diagnoses)) for d in found}
        run_jobs(jobs, workers, "drawing diagnoses")


def _draw(diagnosis: Path, out: Path) -> None:
    from unmodelled.report.figures.files import write_figures

    copy_results(diagnosis, out)
    for figure, fault in write_figures(out).items():
        raise BadInput(f"{diagnosis}: {figure} could not be drawn: {fault}") from fault
    listed = out / "figures" / "figures.json"
    write_json(listed, [{**row, "command": "dvc repro draw_diagnoses"} for row in read_json(listed)])
