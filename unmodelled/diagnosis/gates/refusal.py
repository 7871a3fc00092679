"""A file that an answer does not offer, and why."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from unmodelled.diagnosis.data.result import Diagnosis


@dataclass(frozen=True)
class Refusal:
    """File that an answer does not offer as an improvement."""

    file: str  # name in the folder of an answer
    reason: str  # number or output that is wrong, and how much
    given: str  # name of the file that the user keeps instead

    def __str__(self) -> str:
        return f"{self.file} is not offered: {self.reason}; keep {self.given}"

    @property
    def content(self) -> dict[str, str]:
        """Return the entry in the list `refused` of diagnosis.json."""
        return {"file": self.file, "reason": self.reason, "keep": self.given}


def given_file(diagnosis: Diagnosis) -> str:
    """Return the name of the system file that was diagnosed."""
    return Path(diagnosis.system.source).name if diagnosis.system.source else "the system as given"
