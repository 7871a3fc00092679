"""Run the command `python -m pipeline <verb> ...`: verbs of the library and of the dissertation."""

from __future__ import annotations

from pathlib import Path

from unmodelled.__main__ import LIBRARY, version
from unmodelled.cli import command_line
from unmodelled.cli.program import Program, Source

PACKAGE = Path(__file__).parent
CONF = PACKAGE.parent / "conf"
DISSERTATION = Source("pipeline.stages", PACKAGE / "stages", CONF)


def _version() -> str:
    from pipeline.revision import revision

    return f"{version()[:-1]}, revision {revision()})"


def _note(command: str, configuration: str, seed: int | None, seconds: float) -> None:
    from pipeline.execution import note

    note(command, configuration, seed, seconds)


PROGRAM = Program("python -m pipeline", (DISSERTATION, LIBRARY), _version, _note)


def main(arguments: list[str]) -> int:
    """Run one verb.

    Args:
        arguments: words of the command line after the name of the program.

    Returns:
        Exit code: 0 done, 1 fault of the program, 2 bad input, 130 interrupted.
    """
    return command_line.main(PROGRAM, arguments)


if __name__ == "__main__":
    command_line.run(PROGRAM)
