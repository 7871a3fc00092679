"""Run the command `unmodelled <verb> key=value ...`, the same as `python -m unmodelled`."""

from __future__ import annotations

import sys
from pathlib import Path

from unmodelled.cli.command_line import run
from unmodelled.cli.program import Program, Source

PACKAGE = Path(__file__).parent
LIBRARY = Source("unmodelled.cli.verbs", PACKAGE / "cli" / "verbs", PACKAGE / "conf")


def version() -> str:
    """Return the version of the library and of Python."""
    from importlib.metadata import version as installed

    return f"unmodelled {installed('unmodelled')} (Python {'.'.join(map(str, sys.version_info[:3]))})"


PROGRAM = Program("unmodelled", (LIBRARY,), version)


def console() -> None:
    """Run the command line."""
    run(PROGRAM)


if __name__ == "__main__":
    console()
