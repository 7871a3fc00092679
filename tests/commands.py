"""Commands as a user gives them: in a process of their own, and in this one, which has its libraries."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from pipeline.__main__ import main

ROOT = Path(__file__).parents[1]


def python(*words: str | Path, cwd: Path = ROOT, **more: str | None) -> subprocess.CompletedProcess[str]:
    """What a new interpreter says and returns; it finds the packages, and has no variable that is None."""
    variables = {name: value for name, value in {**os.environ, **more}.items() if value is not None}
    return subprocess.run([sys.executable, *words], cwd=cwd, env=variables, capture_output=True, text=True)


def exit_code(*words: str, program: Callable[[list[str]], int] = main) -> int:
    """Exit code of a command in this process."""
    try:
        return program(list(words))
    except SystemExit as left:
        assert left.code is None or isinstance(left.code, int)
        return left.code or 0
