"""Planted dry friction in one joint of a robot: its file is the known physics, its logs are MuJoCo's."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest

import unmodelled
from tests.machines.folders import write_runs
from unmodelled.base.files import read_json

ARM = """<mujoco><option timestep="0.001"/><worldbody>
<body name="upper"><joint name="shoulder" axis="0 1 0" damping="0.05"/>
<inertial mass="0.8" pos="0 0 -0.2" diaginertia="0.01 0.01 0.001"/>
<body name="lower" pos="0 0 -0.3"><joint name="elbow" axis="0 1 0" damping="0.02"/>
<inertial mass="0.4" pos="0 0 -0.15" diaginertia="0.004 0.004 0.001"/></body></body>
</worldbody><actuator><motor name="shoulder" joint="shoulder"/><motor name="elbow" joint="elbow"/></actuator>
</mujoco>
"""
SYSTEM = """schema: system/1
name: arm
model: arm.xml
inputs: {u_shoulder: {hold: true}, u_elbow: {hold: true}}
"""
FRICTION, PERIOD, SAMPLES, RUNS = 0.12, 0.005, 400, 5


def record(folder: Path) -> None:
    """Torques that are held between samples, and angles with the noise of an encoder."""
    model = mujoco.MjModel.from_xml_string(ARM)
    model.dof_frictionloss[1] = FRICTION
    steps, rng, tables = round(PERIOD / model.opt.timestep), np.random.default_rng(0), []
    for _ in range(RUNS):
        data = mujoco.MjData(model)
        rates, phases = rng.uniform(1.0, 9.0, (2, 4)), rng.uniform(0.0, 6.28, (2, 4))
        rows = []
        for k in range(SAMPLES):
            u = np.array([0.9, 0.35]) * np.sin(rates * k * PERIOD + phases[:, [0]] + phases).sum(1)
            rows.append([k * PERIOD, *u, *data.qpos + 2e-4 * rng.standard_normal(2)])
            data.ctrl[:] = u
            mujoco.mj_step(model, data, steps)
        tables.append(pd.DataFrame(rows, columns=["t", "u_shoulder", "u_elbow", "shoulder", "elbow"]))
    write_runs(folder, tables)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    (tmp_path / "arm.xml").write_text(ARM)
    (tmp_path / "system.yaml").write_text(SYSTEM)
    record(tmp_path / "logs")
    return tmp_path


@pytest.mark.long
def test_the_dry_friction_of_an_elbow_is_named(arm: Path) -> None:
    known = unmodelled.read_system(arm / "system.yaml")
    logs = unmodelled.read_logs(arm / "logs", known)
    before = unmodelled.simulate(known, logs)
    answer = unmodelled.diagnose(known, logs)
    assert answer.verdict in ("effect", "main_effect")
    first = answer.effects[0]
    assert (first.family, first.port) == ("coulomb_friction", "elbow")
    assert first.parameters["F_c"]["value"] == pytest.approx(FRICTION, rel=0.1)
    answer.save(arm / "answer")
    again = unmodelled.read_system(arm / "answer" / "augmented_system.yaml")
    after = unmodelled.simulate(again, unmodelled.read_logs(arm / "logs", again))
    assert after.gap.value < 0.2 * before.gap.value

    robot = read_json(arm / "answer" / "diagnosis.json")["robot"]
    patched = mujoco.MjModel.from_xml_path(str(arm / "answer" / robot["file"]))
    assert patched.dof_frictionloss[1] == pytest.approx(FRICTION, rel=0.1)
    assert robot["replay"]["improves"]
    assert robot["replay"]["patched"]["gap"] < 0.2 * robot["replay"]["given"]["gap"]
