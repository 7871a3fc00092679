"""Paths of withheld cases and their diagnoses: <campaign>/<case>, one kind of cases per campaign."""

from __future__ import annotations

from pathlib import Path

from unmodelled.base.errors import BadInput

#: In the folder of a case: what a user hands over, and the truth.
SYSTEM, LOGS, TRUTH = "system.yaml", "logs", "truth.json"
#: Of a folder of diagnoses: what they cost.
COSTS = "costs"
#: Of a campaign: where it comes from.
PROVENANCE = "provenance.json"


def campaigns_in(folder: Path) -> list[Path]:
    """Return the folders of campaigns, sorted.

    Args:
        folder: folder of all campaigns.

    Raises:
        BadInput: when there is no campaign.
    """
    return _found(folder, PROVENANCE, "campaign of withheld cases")


def cases_in(campaign: Path) -> list[Path]:
    """Return the folders of cases, sorted.

    Args:
        campaign: folder of the campaign.

    Raises:
        BadInput: when there is no case.
    """
    return _found(campaign, SYSTEM, "withheld case")


def _found(folder: Path, file: str, what: str) -> list[Path]:
    found = [path.parent for path in sorted(folder.glob(f"[!.]*/{file}"))]
    if not found:
        raise BadInput(f"{folder}: holds no {what}, a folder with {file}")
    return found
