"""Run the command `python -m pipeline <verb> ...`: verbs of the library and of the dissertation."""

import os
import platform
import sys
from pathlib import Path
from urllib.parse import quote

from unmodelled.cli import command_line
from unmodelled.cli.program import LIBRARY, Program, Source, version

PACKAGE = Path(__file__).parent
CONF = PACKAGE.parent / "conf"
DISSERTATION = Source("pipeline.stages", PACKAGE / "stages", CONF)

#: Folder of notes on executed stages, beside the outputs: an output that holds a time never equals itself.
EXECUTIONS = Path("data") / "executions"

#: Packages whose version can change a number, a figure or a time.
PACKAGES = (
    *("dvc", "hydra-core", "matplotlib", "mujoco", "numba", "numpy", "pandas"),
    *("pyarrow", "scikit-learn", "scipy", "shap", "sympy", "torch"),
)


def _version() -> str:
    from pipeline.revision import revision

    return f"{version()[:-1]}, revision {revision()})"


def note(command: str, configuration: str, seed: int | None, seconds: float) -> None:
    """Write `EXECUTIONS`/<stage>.json if DVC runs this command as a stage; nothing if a user does.

    The file is renamed into place after the stage has written its outputs, so that a killed stage leaves the
    note of its last complete execution.

    Takes seconds in s.
    """
    # the name of a stage is unique in the whole graph, in whichever file it is defined
    stage = os.environ.get("DVC_STAGE", "").rpartition(":")[2]
    if not stage:
        return
    from datetime import UTC, datetime
    from importlib.metadata import version as installed

    from pipeline.revision import revision
    from unmodelled.base.files import write_json

    content = {
        "stage": stage,
        "command": command,
        "configuration": configuration,
        "seed": seed,
        "seconds": round(seconds, 3),
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
        "revision": revision(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "versions": {"python": platform.python_version(), **{name: installed(name) for name in PACKAGES}},
    }
    root = Path(os.environ.get("DVC_ROOT", "."))
    write_json(root / EXECUTIONS / f"{quote(stage, safe='@')}.json", content)


PROGRAM = Program("python -m pipeline", (DISSERTATION, LIBRARY), _version, note)


def main(arguments: list[str]) -> int:
    """Run one verb."""
    return command_line.main(PROGRAM, [*arguments, *_keys(arguments)])


def _keys(arguments: list[str]) -> list[str]:
    """Return the words that params.yaml adds to a command that is a stage of the graph."""
    if not arguments or "DVC_STAGE" not in os.environ:
        return []
    from pipeline.keys import added_words, read_keys

    return added_words(read_keys(), arguments, PROGRAM)


if __name__ == "__main__":
    sys.argv += _keys(sys.argv[1:])
    command_line.run(PROGRAM)
