"""Run the command `unmodelled <verb> key=value ...`, the same as `python -m unmodelled`."""

from __future__ import annotations

import os
import sys
from contextlib import chdir
from importlib import import_module
from pathlib import Path

# with -m, Python looks for modules in the working folder first, where files of a stranger may lie beside logs
if __name__ == "__main__" and not sys.flags.safe_path and sys.path[0] != str(Path(__file__).parents[1]):
    del sys.path[0]

from unmodelled.base.workers import SAFE_PATH
from unmodelled.cli.command_line import run
from unmodelled.cli.program import LIBRARY, Program, version

#: Libraries that read settings from a file of the working folder while they are imported.
SETTINGS = {"matplotlibrc": "matplotlib", ".numba_config.yaml": "numba"}
PROGRAM = Program("unmodelled", (LIBRARY,), version)


def console() -> None:
    """Run the command line."""
    os.environ |= SAFE_PATH  # of all processes that libraries start
    for file, library in SETTINGS.items():
        if os.path.lexists(file):
            with chdir(Path(__file__).parent):
                import_module(library)
    run(PROGRAM)


if __name__ == "__main__":
    console()
