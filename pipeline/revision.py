"""Which revision of the code made a result."""

from __future__ import annotations

import subprocess
from pathlib import Path

#: What decides a result, beside what params.yaml chooses. Results in git do not make the code another.
CODE = ("unmodelled", "pipeline", "conf", "systems", "dvc.yaml")

#: The folder of this program.
PACKAGE = Path(__file__).parent


def revision() -> str:
    """Short name of the checked-out commit, with -dirty where the code differs from it."""
    try:
        name = _git("describe", "--always")
        return f"{name}-dirty" if _git("status", "--porcelain", "--", *CODE) else name
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()
