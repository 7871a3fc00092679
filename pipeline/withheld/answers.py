"""Read the diagnoses of withheld cases together with the planted effects."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pipeline.chapters.reported import read_judged, read_refit, read_truth
from pipeline.withheld.channels import parameter_channels
from pipeline.withheld.folders import SYSTEM, TRUTH, campaigns_in, cases_in
from pipeline.withheld.judging import judged
from unmodelled.base.errors import BadInput
from unmodelled.systems.reader import read_system


def answers(
    cases: Path, diagnoses: Path, refits: Path
) -> Iterator[tuple[Path, dict[str, Any], dict[str, Any]]]:
    """Return the place <campaign>/<case>, the content of diagnosis.json and the table row (see `judged`) of
    every case.

    Args:
        cases: folder of campaigns of withheld cases, one kind per campaign.
        diagnoses: folder written by `diagnose_withheld`.
        refits: folder written by `refit_withheld`.

    Raises:
        BadInput: when an input is missing or damaged.
    """
    for case in (case for campaign in campaigns_in(cases) for case in cases_in(campaign)):
        place = case.relative_to(cases)
        said = read_judged(diagnoses / place.parent / f"{case.name}.json")
        path = refits / place.parent / f"{case.name}.json"
        truth, refit = read_truth(case / TRUTH), read_refit(path)
        if len(refit["oracle"]["seen"]) != len(truth["effects"]):
            raise BadInput(
                f"{path}: oracle.seen: must have {len(truth['effects'])} entries, as many as planted"
            )
        yield place, said, judged(truth, said, refit, parameter_channels(read_system(case / SYSTEM)))
