"""Read the diagnoses of withheld cases together with the planted effects."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pipeline.chapters.reported import read_judged, read_refit, read_truth, read_validation
from pipeline.withheld.channels import parameter_channels
from pipeline.withheld.folders import SYSTEM, TRUTH, VALIDATION, campaigns_in, cases_in
from pipeline.withheld.judging import judged
from unmodelled.base.errors import BadInput
from unmodelled.systems.reader import read_system


def answers(
    cases: Path, diagnoses: Path, refits: Path
) -> Iterator[tuple[Path, dict[str, Any], dict[str, Any]]]:
    """Return the place <campaign>/<case>, the content of diagnosis.json and the table row (see `judged`) of
    every case.
    """
    for case in (case for campaign in campaigns_in(cases) for case in cases_in(campaign)):
        place = case.relative_to(cases)
        name = f"{case.name}.json"
        yield place, *answer(case, diagnoses / place.parent / name, refits / place.parent / name)


def answer(case: Path, diagnosis: Path, refit: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the content of diagnosis.json and the table row (see `judged`) of a case."""
    said, truth, best = read_judged(diagnosis), read_truth(case / TRUTH), read_refit(refit)
    if len(best["oracle"]["seen"]) != len(truth["effects"]):
        raise BadInput(f"{refit}: oracle.seen: must have {len(truth['effects'])} entries, as many as planted")
    acts_at = parameter_channels(read_system(case / SYSTEM))
    errors = diagnosis.parent / VALIDATION / diagnosis.name
    validation = read_validation(errors) if (case / VALIDATION).exists() else None
    return said, judged(truth, said, best, acts_at, validation)
