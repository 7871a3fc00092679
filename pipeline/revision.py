"""Which revision of the code made a result."""

from __future__ import annotations

import subprocess


def revision() -> str:
    """Short name of the checked-out commit, with -dirty where files differ from it."""
    git = ["git", "describe", "--always", "--dirty"]
    try:
        return subprocess.run(git, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
