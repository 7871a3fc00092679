"""Archives in the formats in which the machines were published, small and with known content."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.recordings.cascaded_tanks import CascadedTanksRecording
from pipeline.recordings.double_pendulum import DoublePendulumRecording
from pipeline.recordings.silverbox import SAMPLES, SilverboxRecording
from pipeline.recordings.so101 import So101Recording
from pipeline.recordings.ur10e import Ur10eJointRecording
from pipeline.recordings.xl330 import Xl330Recording
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.fit import ParameterFit, fit_parameters
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

JOINTS = ("Pitch", "Rotation", "Elbow")


@dataclass(frozen=True)
class Machine:
    """A class of pipeline/recordings and what belongs to it."""

    recording: Callable[[str | None], Any]
    variable: str  # of the environment, with the published archive
    write: Callable[[Path], None]  # an archive like it
    experiments: int  # in the published archive
    horizon: float  # of a diagnosis, s


def fits(systems: Path, logs: Path) -> dict[str, ParameterFit]:
    """Fits of the system files of a machine to logs, by the names of the files."""
    found = {}
    for path in sorted(systems.glob("*_withheld.yaml")):
        system = read_system(path)
        recording = Recording.of(read_logs(logs, system), 0.1)
        found[path.stem.removesuffix("_withheld")] = fit_parameters(Simulation(system, recording))
    return found


def xl330(folder: Path) -> None:
    """Two runs, logged at 190 and 285 samples a second; the second one switches the servo off."""
    header = {"mass": 0.49, "length": 0.1, "vin": 7.4, "motor": "xl330"}
    for kp, trajectory, period in ((100, "sin_sin", 0.0053), (400, "lift_and_drop", 0.0035)):
        t = 0.003 + np.arange(200) * period
        position, goal = 0.3 * np.sin(8.0 * t), 0.5 * np.sin(8.0 * t)
        columns = {"timestamp": t, "position": position, "goal_position": goal}
        entries = pd.DataFrame({**columns, "torque_enable": (t < 0.4) | (kp == 100)}).to_dict("records")
        run = {**header, "kp": kp, "trajectory": trajectory, "entries": entries}
        (folder / f"2026-01-15_10h28m{kp}.json").write_text(json.dumps(run))


def so101(folder: Path) -> None:
    """Two recordings of 50 s; the joint that is read is not the first one in the lists."""
    for k, name in enumerate(("chirp_sweep", "step_response"), start=1):
        at = folder / name
        at.mkdir()
        t = 5.0 + 20060.0 * np.arange(2500)
        angle = 0.1 * k * np.sin(3e-6 * t)
        lists = [json.dumps([9.0, x, -9.0]) for x in angle.round(6).tolist()]
        goals = [json.dumps([9.0, x, -9.0]) for x in (2.0 * angle).round(6).tolist()]
        (at / "joint_list.txt").write_text("\n".join(JOINTS))
        states = {"type": "STATE_MOTOR", "timestamp": t, "positions": lists, "velocities": "[]"}
        pd.DataFrame(states).to_csv(at / "state_motor.csv", index=False)
        control = {"type": "CONTROL", "timestamp": t, "positions": goals}
        pd.DataFrame(control).to_csv(at / "control.csv", index=False)


def ur10e(folder: Path) -> None:
    """Joint 1 moves; the columns of a file have no names, and the clock counts from long ago."""
    t = 1297.5 + np.cumsum(np.tile([0.01, 0.01, 0.012], 200))
    table = np.zeros((len(t), 31))
    table[:, 0], table[:, 1], table[:, 7], table[:, 13] = t, np.sin(t), np.cos(t), 4.0 * np.cos(t)
    (folder / "jointwise_motion").mkdir()
    path = folder / "jointwise_motion" / "ur-20_01_22-joint_1.csv"
    np.savetxt(path, table, fmt="%.4f", delimiter=",")


def double_pendulum(folder: Path) -> None:
    """Two recordings, one of them logged faster, and one with friction compensated, which does not count."""
    for name in ("sys_id", "sys_id_friction_compensated"):
        (folder / name).mkdir()
    for number, period in ((0, 0.002), (11, 0.0015)):
        t = period * np.arange(600)
        columns = {"time": t}
        for k in (1, 2):
            columns |= {f"pos_meas{k}": np.sin(k * t), f"vel_meas{k}": k * np.cos(k * t)}
            columns |= {f"tau_con{k}": k * np.sign(np.sin(9.0 * t)), f"tau_meas{k}": 0.0 * t}
        pd.DataFrame(columns).to_csv(folder / "sys_id" / f"trajectory_{number:02d}.csv", index=False)
    other = pd.DataFrame({"time": [0.0], " pos1": [0.0]})
    other.to_csv(folder / "sys_id_friction_compensated" / "measured.csv", index=False)


def silverbox(folder: Path) -> None:
    """The length of the published record; its header ends with a comma, its rows do not."""
    n = np.arange(SAMPLES)
    rows = np.stack([0.1 * np.sin(0.01 * n), 0.2 * np.sin(0.01 * n - 0.3)], axis=1)
    np.savetxt(folder / "SNLS80mV.csv", rows, "%.6f", ",", header='"V1","V2",', comments="")


def cascaded_tanks(folder: Path) -> None:
    """Both records in one table with a column that has one number."""
    t = 4.0 * np.arange(300)
    columns = [3.0 + np.sin(0.01 * k * t) for k in (1, 2, 3, 4)]
    lines = [",".join(f"{c[i]:.5g}" for c in columns) + (",4," if i == 0 else ",,") for i in range(len(t))]
    (folder / "dataBenchmark.csv").write_text("\n".join(['"uEst","uVal","yEst","yVal","Ts",', *lines]) + "\n")


MACHINES = {
    "xl330": Machine(Xl330Recording, "XL330", xl330, 16, 0.5),
    "so101": Machine(So101Recording, "SO101", so101, 12, 0.5),
    "ur10e_joint": Machine(Ur10eJointRecording, "UR10E", ur10e, 8, 0.5),
    "double_pendulum": Machine(DoublePendulumRecording, "DOUBLE_PENDULUM", double_pendulum, 9, 0.5),
    "silverbox": Machine(SilverboxRecording, "SILVERBOX", silverbox, 15, 0.1),
    "cascaded_tanks": Machine(CascadedTanksRecording, "CASCADED_TANKS", cascaded_tanks, 6, 200.0),
}
