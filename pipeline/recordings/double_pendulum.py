"""Measurements of a double pendulum with a motor at each joint (design A.0).

F. Wiebe et al., "Open source dual-purpose acrobot and pendubot platform", IEEE Robotics and Automation
Magazine, 2023; recordings of dfki-ric-underactuated-lab/double_pendulum at github.com, folder
data/experiment_records/design_A.0, BSD-3-Clause.
"""

from dataclasses import dataclass
from pathlib import PurePosixPath

from pipeline.recordings.archive import Archive
from pipeline.recordings.log_folder import Experiment, Recording, on_clock

#: Columns of a log, and those of the files: commanded torques (N m), angles (rad; the second one from the
#: first link), speeds (rad/s).
COLUMNS = {
    "t": "time",
    **{f"u{k}": f"tau_con{k}" for k in (1, 2)},
    **{f"q{k}": f"pos_meas{k}" for k in (1, 2)},
    **{f"v{k}": f"vel_meas{k}" for k in (1, 2)},
}
#: Columns that jump.
HELD = ("u1", "u2")


@dataclass(frozen=True)
class DoublePendulumRecording(Recording):
    """The recordings for system identification as a log folder, one experiment per recording.

    The recording with friction compensation by a controller is left out, because it shows another machine.

    Attributes:
        archive: path of a zip file or folder with sys_id/*.csv.
        period: sampling period of the logs, s; default 0.002. One recording was logged faster.
    """

    archive: str | None
    period: float = 0.002

    about = {  # noqa: RUF012
        "description": "public measurements of a double pendulum with two motors: torques, motion",
        "url": "https://github.com/dfki-ric-underactuated-lab/double_pendulum",
        "licence": "BSD-3-Clause",
    }

    def experiments(self) -> list[Experiment]:
        archive = Archive(self.archive, "DOUBLE_PENDULUM")
        names = {new: old for old, new in COLUMNS.items()}
        experiments = []
        for name in archive.names("sys_id/*.csv"):
            recording = archive.table(name, list(names)).rename(columns=names)
            samples = on_clock(recording, self.period, HELD, archive.where(name))
            experiments.append(Experiment(PurePosixPath(name).stem, samples))
        return experiments
