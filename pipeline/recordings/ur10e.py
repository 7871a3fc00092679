"""Measurements of an industrial UR10e arm, one joint at a time.

S. Mamedov and S. Mikhel, "Practical aspects of model-based collision detection", Frontiers in Robotics and
AI 7, 2020; recordings of shamilmamedov/dynamic_calibration at github.com, folder
dataset_ur10e/jointwise_motion.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from pipeline.recordings.archive import Archive
from pipeline.recordings.log_folder import Experiment, Recording, parts
from unmodelled.base.errors import BadInput

JOINTS = range(1, 7)
#: Columns of a file, which has no header: time (s), angle (rad), speed (rad/s), measured and desired current
#: (A) and desired torque (N m) of every joint.
COLUMNS = ("t", *(f"{name}{k}" for name in ("q", "qd", "i", "i_des", "tau_des") for k in JOINTS))


@dataclass(frozen=True)
class Ur10eJointRecording(Recording):
    """The motion of one joint, with the others at rest, as a log folder of equally long experiments.

    The sampling period varies between 10 and 12 ms.

    Attributes:
        archive: path of a zip file or folder with the files of jointwise_motion.
        joint: number of the joint, 1 (at the base) to 6; default 1.
        parts: number of experiments; default 8.
    """

    archive: str | None
    joint: int = 1
    parts: int = 8

    @property
    def about(self) -> Mapping[str, str]:
        return {
            "description": f"public measurements of joint {self.joint} of a UR10e: current, angle, speed",
            "url": "https://github.com/shamilmamedov/dynamic_calibration",
        }

    def experiments(self) -> list[Experiment]:
        if self.joint not in JOINTS:
            raise BadInput(f"source.joint: must be 1 to 6, got {self.joint!r}")
        archive = Archive(self.archive, "UR10E")
        name = archive.names(f"*joint_{self.joint}.csv")[0]
        wanted = {"t": "t", f"i{self.joint}": "i", f"q{self.joint}": "q", f"qd{self.joint}": "v"}
        recording = archive.table(name, list(wanted), COLUMNS).rename(columns=wanted)
        cut = parts(recording, self.parts, archive.where(name))
        return [Experiment(f"part_{k}", part) for k, part in enumerate(cut, start=1)]
