"""Paths of withheld cases and their diagnoses: <campaign>/<case>, one kind of cases per campaign."""

from collections.abc import Sequence
from pathlib import Path

from unmodelled.base.errors import BadInput

#: In the folder of a case: what a user hands over, and the truth.
SYSTEM, LOGS, TRUTH = "system.yaml", "logs", "truth.json"
#: Of a folder of diagnoses: what they cost, and errors on validation experiments. In the folder of a case
#: the latter holds the experiments.
COSTS, VALIDATION = "costs", "validation"
#: Of a campaign: where it comes from.
PROVENANCE = "provenance.json"


def campaigns_in(folder: Path) -> list[Path]:
    """Return the folders of campaigns, sorted."""
    return _found(folder, (f"*/{PROVENANCE}", f"*/*/{PROVENANCE}"), "campaign of withheld cases")


def cases_in(campaign: Path) -> list[Path]:
    """Return the folders of cases, sorted."""
    return _found(campaign, (f"*/{SYSTEM}",), "withheld case")


def _found(folder: Path, patterns: Sequence[str], what: str) -> list[Path]:
    found = sorted(path for pattern in patterns for path in folder.glob(pattern))
    shown = [p.parent for p in found if not any(part.startswith(".") for part in p.relative_to(folder).parts)]
    if not shown:
        raise BadInput(f"{folder}: holds no {what}, a folder with {Path(patterns[0]).name}")
    return shown
