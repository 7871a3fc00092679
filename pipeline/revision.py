"""Determine the revision of the code that made a result."""

import subprocess
from pathlib import Path

#: What decides a result, beside what params.yaml chooses. Results in git do not make the code another.
CODE = ("unmodelled", "pipeline", "conf", "systems", "dvc.yaml")

#: The folder of this program, and its checkout: settings of a repository in which it is started are not used.
PACKAGE = Path(__file__).parent
CHECKOUT = PACKAGE.parent


def revision() -> str:
    """Return the short name of the last commit that changed the code, with -dirty where files differ from it.

    A commit of results alone does not change it, so that a clone makes results of the same revision.
    """
    try:
        name = _git("log", "-1", "--format=%h", "--", *CODE) or "unknown"
        return f"{name}-dirty" if _git("status", "--porcelain", "--", *CODE) else name
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=CHECKOUT, capture_output=True, text=True, check=True)
    return done.stdout.strip()
