"""Measurements of an SO-101 arm with six position servos (Feetech STS3215): its first, vertical joint.

Recordings of isaac-sim2real/sage at github.com, folder output/real/so101/custom; masses, inertias and gains
in TheRobotStudio/SO-ARM100, folder Simulation/SO101; both Apache-2.0.
"""

import json
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np
import pandas as pd

from pipeline.recordings.archive import Archive, measured, numbers
from pipeline.recordings.log_folder import Experiment, Recording
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput

#: The joint that is read, as joint_list.txt calls it.
JOINT = "Rotation"
MICROSECOND = 1e-6  # s


@dataclass(frozen=True)
class So101Recording(Recording):
    """The first joint in every recording as a log folder, one experiment per recording.

    Commanded and measured angles have the same time stamps. The arm above the joint keeps about the same
    posture, and so the joint keeps its inertia, except in `large_amplitude`.

    Attributes:
        archive: path of a zip file or folder with one folder per recording.
        seconds: duration that is read from the start of each recording, s; default 40.
    """

    archive: str | None
    seconds: float = 40.0

    about = {  # noqa: RUF012
        "description": "public measurements of the first joint of an SO-101 arm: command, angle",
        "url": "https://github.com/isaac-sim2real/sage",
        "licence": "Apache-2.0",
    }

    def experiments(self) -> list[Experiment]:
        if not isinstance(self.seconds, int | float) or not self.seconds > 0.0:
            raise BadInput(f"source.seconds: must be a positive number, got {self.seconds!r}")
        archive = Archive(self.archive, "SO101")
        experiments = []
        for states in archive.names("state_motor.csv"):
            at = PurePosixPath(states)
            control = str(at.with_name("control.csv"))
            joint = _joint(archive, str(at.with_name("joint_list.txt")))
            t, q = _angles(archive, states, joint)
            t_goal, goal = _angles(archive, control, joint)
            if not np.array_equal(t, t_goal):
                where = archive.where(control)
                raise BadInput(f"{where}: column timestamp: must be the same as in state_motor.csv")
            samples = pd.DataFrame({"t": t, "goal": goal, "q": q})
            name = at.parent.name or archive.path.stem
            experiments.append(Experiment(name, samples[t <= t[0] + self.seconds]))
        return experiments


def _joint(archive: Archive, name: str) -> int:
    joints = archive.read(name).decode("utf-8", "replace").split()
    if JOINT not in joints:
        raise BadInput(f"{archive.where(name)}: names no joint {JOINT}, only {', '.join(joints)[:80]}")
    return joints.index(JOINT)


def _angles(archive: Archive, name: str, joint: int) -> tuple[Array, Array]:
    """Time (n,), s, and angle (n,), rad, of one joint; a cell of `positions` lists all joints."""
    where = archive.where(name)
    cells = archive.cells(name, ["timestamp", "positions"])
    t = numbers(cells["timestamp"], where, "timestamp", 2)
    angles = [
        _angle(cell, joint, f"{where}: row {row}") for row, cell in enumerate(cells["positions"], start=2)
    ]
    return t * MICROSECOND, np.array(angles)


def _angle(cell: str, joint: int, where: str) -> float:
    try:
        angle = measured(json.loads(cell)[joint])
    except (ValueError, TypeError, LookupError, RecursionError):
        angle = None
    if angle is None:
        raise BadInput(f"{where}: column positions: {cell[:30]!r} has no number for the joint")
    return angle
