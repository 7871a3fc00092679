"""Small systems with logs to try the library on, shipped with it."""

from __future__ import annotations

import shutil
from pathlib import Path

from unmodelled.base.errors import BadInput, closest
from unmodelled.base.files import replacing_folder
from unmodelled.logs.inputs import read_inputs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

FOLDER = Path(__file__).parent / "examples"


def example(name: str = "pendulum") -> tuple[System, Logs]:
    """Read an example: a system file that leaves something out, and logs of its machine.

    The logs are simulated, not measured.

    - `pendulum`: a driven pendulum with an encoder, four experiments of 2 s; the system file leaves out the
      dry friction of the joint.
    - `flywheel`: a flywheel that a brake stops, 24 experiments of 12 s; the torque of the brake differs from
      experiment to experiment.

    Args:
        name: name of the example; default: pendulum.

    Returns:
        System and logs.

    Raises:
        BadInput: when there is no such example.

    Examples:
        >>> import unmodelled as um
        >>> system, logs = um.example("pendulum")
        >>> system
        system pendulum
        states: theta (rad); omega (rad/s)
        inputs: torque (N m)
        outputs: theta (rad)
        parameters: J = 0.02 kg m^2; b = 0.01 N m s/rad, to be identified; mgl = 1.2 N m
        ports: joint (N m)
        dynamics:
          theta' = omega
          omega' = (-b*omega - mgl*sin(theta) - tau + torque)/J
        >>> logs.ids
        ('run1', 'run2', 'run3', 'run4')
    """
    folder = _folder(name)
    return read_inputs(folder / f"{name}.yaml", folder / "logs")


def write_example(name: str, out: Path) -> None:
    """Write the files of an example: `<name>.yaml` and the folder `logs`.

    Args:
        name: name of the example, see `example`.
        out: folder, replaced as a whole.

    Raises:
        BadInput: when there is no such example.
    """
    folder = _folder(name)
    with replacing_folder(out) as new:
        shutil.copyfile(folder / f"{name}.yaml", new / f"{name}.yaml")
        (new / "logs").mkdir()
        for path in sorted((folder / "logs").iterdir()):
            shutil.copyfile(path, new / "logs" / path.name)


def _folder(name: str) -> Path:
    known = sorted(folder.name for folder in FOLDER.iterdir())
    if name not in known:
        raise BadInput(f"example: there is no {name!r}{closest(str(name), known)}")
    return FOLDER / name
