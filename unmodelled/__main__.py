"""Run the command `unmodelled <verb> key=value ...`, the same as `python -m unmodelled`."""

from __future__ import annotations

from unmodelled.cli.command_line import run
from unmodelled.cli.program import LIBRARY, Program, version

PROGRAM = Program("unmodelled", (LIBRARY,), version)


def console() -> None:
    """Run the command line."""
    run(PROGRAM)


if __name__ == "__main__":
    console()
