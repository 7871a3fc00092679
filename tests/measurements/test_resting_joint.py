"""Joints that rest in some recordings, as in the logs of whole arms, and sensors that are dead."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.physics.robot.test_motion import DOUBLE
from unmodelled.base.errors import BadInput
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

T = np.arange(0.0, 2.0, 0.01)
WAVE = np.sin(5.0 * T)
REST = np.full_like(T, 0.4)
Column = NDArray[np.float64]


def logs_of(folder: Path, runs: dict[str, dict[str, Column]], more: str = "") -> Path:
    """A log folder of the double pendulum with the given columns in place of waves, and its system file."""
    logs = folder / "logs"
    logs.mkdir(parents=True)
    (folder / "double.urdf").write_text(DOUBLE)
    file = folder / "system.yaml"
    file.write_text(f"schema: system/1\nname: double\nmodel: double.urdf\n{more}")
    table = ["id,file"]
    for name, columns in runs.items():
        known = {"t": T, "tau_one": 2.0 * WAVE, "tau_two": WAVE, "one": 0.3 * WAVE, "two": WAVE} | columns
        rows = [
            ",".join(known),
            *(",".join(f"{x:.9g}" for x in row) for row in zip(*known.values(), strict=True)),
        ]
        (logs / f"{name}.csv").write_text("\n".join(rows) + "\n")
        table.append(f"{name},{name}.csv")
    (logs / "experiments.csv").write_text("\n".join(table) + "\n")
    return file


def refused(folder: Path, runs: dict[str, dict[str, Column]]) -> str:
    file = logs_of(folder, runs)
    with pytest.raises(BadInput) as caught:
        read_logs(file.parent / "logs", read_system(file))
    return "\n".join([str(caught.value), *caught.value.others]).replace(f"{folder}/logs/", "")


def test_a_joint_that_rests_while_others_move_is_no_dead_output(tmp_path: Path) -> None:
    """The torque that holds it against the other joint changes, but less than one that moves it."""
    runs = {"both": {}, "one": {"two": REST, "tau_two": 0.3 * WAVE}, "two": {"one": REST, "tau_one": 0.0 * T}}
    file = logs_of(tmp_path, runs)
    found = read_logs(tmp_path / "logs", read_system(file))
    assert [*found.experiments["id"]] == ["both", "one", "two"]


def test_a_sensor_that_stands_still_while_its_drive_moves_is_dead(tmp_path: Path) -> None:
    message = refused(tmp_path, {"a": {}, "b": {"two": REST}, "c": {}})
    assert (
        message
        == "b.csv: row 2: column two: dead output, 0.4 in every row while its drive moves: leave the "
        + ("experiment out")
    )


def test_a_joint_that_never_moves_is_to_be_locked(tmp_path: Path) -> None:
    message = refused(tmp_path, {name: {"two": REST, "tau_two": 0.1 * WAVE} for name in "ab"})
    assert message.count("dead output") == 2
    assert (
        "a.csv: row 2: column two: dead output, 0.4 in every row: lock the joint (locked: {two: 0.4})"
        in message
    )


def test_parts_of_a_log_with_gaps_stay_in_which_a_joint_rests(tmp_path: Path) -> None:
    """A part in which the drive of a resting joint moves is left out: its sensor is dead there."""
    part, swing = np.arange(len(T)) // 50, np.sin(4.0 * np.pi * T)  # two swings in every part of 50 samples
    held = {"two": 0.4 + np.where(part % 2 == 1, 0.0, swing), "tau_two": np.where(part == 1, 0.0, swing)}
    file = logs_of(tmp_path, {"a": held | {"t": T + part}, "b": {}})
    found = read_logs(tmp_path / "logs", read_system(file))
    assert found.ids == ("a.part1", "a.part2", "a.part3", "b")
    np.testing.assert_allclose(found.y[found.rows(1), 1], 0.4)
