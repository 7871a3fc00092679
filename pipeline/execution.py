"""Record executed stages of the graph: time, configuration, seed and versions."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from urllib.parse import quote

from pipeline.revision import revision
from unmodelled.base.files import write_json

#: Beside the outputs of the stages and not among them: an output that holds a time is never equal to itself.
FOLDER = Path("data") / "executions"

#: Whose version can change a number, a figure or a time.
PACKAGES = (
    "dvc",
    "hydra-core",
    "matplotlib",
    "mujoco",
    "numba",
    "numpy",
    "pandas",
    "pyarrow",
    "scikit-learn",
    "scipy",
    "shap",
    "sympy",
    "torch",
)


def note(command: str, configuration: str, seed: int | None, seconds: float) -> None:
    """Write `FOLDER`/<stage>.json if DVC runs the command as a stage; a command of a user is not recorded.

    The file gets its name after the stage has written its outputs, so that a killed stage keeps the record of
    its last complete execution.

    Args:
        command: command line of the stage.
        configuration: resolved configuration as YAML.
        seed: seed of all random numbers; None if there is none.
        seconds: wall time, s.

    Raises:
        BadInput: when the file cannot be written.
    """
    # the name of a stage is its own in the whole graph, in whichever of its files it stands
    stage = os.environ.get("DVC_STAGE", "").rpartition(":")[2]
    if not stage:
        return
    content = {
        "stage": stage,
        "command": command,
        "configuration": configuration,
        "seed": seed,
        "seconds": round(seconds, 3),
        "finished": datetime.now(UTC).isoformat(timespec="seconds"),
        "revision": revision(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "versions": {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}},
    }
    root = Path(os.environ.get("DVC_ROOT", "."))
    write_json(root / FOLDER / f"{quote(stage, safe='@')}.json", content)
