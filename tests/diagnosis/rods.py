"""A rod on a pin as MJCF and as URDF, and logs of it with dry friction and a rotor, simulated by MuJoCo."""

from pathlib import Path

import mujoco
import numpy as np
import pandas as pd

from tests.machines.folders import text_of, write_runs

MJCF = text_of("rod.xml")
URDF = text_of("rod.urdf")
SYSTEM = "schema: system/1\nname: rod\nmodel: {}\ninputs: {{{}: {{column: u, hold: true}}}}\n"
FRICTION, ROTOR, GIVEN_ROTOR = 0.1, 0.008, 0.002
PERIOD, SAMPLES, RUNS = 0.01, 150, 4


def write_rod(folder: Path, robot: str = MJCF, friction: float = FRICTION, rotor: float = ROTOR) -> Path:
    """Write robot.xml or robot.urdf, system.yaml and logs; `rotor`: all of it, kg m^2. Return the system."""
    urdf = "<robot" in robot
    name = "rod.urdf" if urdf else "rod.xml"
    (folder / name).write_text(robot)
    (folder / "system.yaml").write_text(SYSTEM.format(name, "tau_pin" if urdf else "u_drive"))
    model = mujoco.MjModel.from_xml_string(MJCF)
    model.dof_frictionloss[0], model.dof_armature[0] = friction, rotor
    model.opt.timestep = 0.0005
    mujoco.mj_setConst(model, mujoco.MjData(model))
    rng, tables = np.random.default_rng(0), []
    for _ in range(RUNS):
        data, rows = mujoco.MjData(model), []
        rates, phases = rng.uniform(1.0, 9.0, 4), rng.uniform(0.0, 6.28, 4)
        for k in range(SAMPLES):
            u = float(0.6 * np.sin(rates * k * PERIOD + phases).sum())
            noisy = data.qpos[0] + 2e-4 * rng.standard_normal(), data.qvel[0] + 2e-3 * rng.standard_normal()
            rows.append([k * PERIOD, u, *noisy])
            data.ctrl[0] = u
            mujoco.mj_step(model, data, round(PERIOD / model.opt.timestep))
        tables.append(pd.DataFrame(rows, columns=["t", "u", "pin", "speed"]).drop(columns="speed"))
    write_runs(folder / "logs", tables)
    return folder / "system.yaml"
