"""A lag of the drive and one of the sensor are the same in a linear machine, and not in another one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis.diagnoses import Said, told
from tests.machines.folders import logs_of, system_of
from unmodelled.diagnosis.answer.moved_lags import with_moved_lags
from unmodelled.effects.place import Place

FAN = """
schema: system/1
name: fan
states: {w: {unit: rad/s}}
inputs: {U: {unit: V, hold: true}}
outputs: {w: {unit: rad/s}}
parameters: {J: {value: 0.05, unit: kg m^2}, k: {value: 0.6, unit: N m/V}, c: {value: 0.2, unit: N m s/rad},
  F: {value: DRY, unit: N m}}
ports: {shaft: {effort: T_l, unit: N m, velocity: w}}
dynamics: {w: (k*U - c*w - F*sign(w) - T_l)/J}
"""
DRIVE, SPEED = Place("actuator", "U"), Place("sensor", "w")
ENDS = {"sensor_lag": (SPEED, "T_y", "c_y"), "actuator_lag": (DRIVE, "T_u", "c_u")}


@pytest.mark.parametrize(("dry", "linear"), [(0.0, True), (2.0, False)])
@pytest.mark.parametrize("family", ENDS)
def test_the_other_end_is_listed_where_it_predicts_as_well(
    family: str, dry: float, linear: bool, tmp_path: Path
) -> None:
    """The planted fan has a drive or a sensor with a lag of 0.06 s."""
    rng, tables = np.random.default_rng(5), []
    for _ in range(4):
        U = np.repeat(rng.uniform(-6.0, 6.0, 15), 20)
        w, lag, seen = 0.0, 0.0, []
        for volts in U:
            seen.append(lag if family == "sensor_lag" else w)
            for _ in range(20):
                torque = 0.6 * (lag if family == "actuator_lag" else volts) - 0.2 * w
                w += 5e-4 * (torque - dry * np.tanh(w / 0.01)) / 0.05
                lag += 5e-4 * ((w if family == "sensor_lag" else volts) - lag) / 0.06
        noisy = np.array(seen) + 0.02 * rng.standard_normal(len(U))
        tables.append(pd.DataFrame({"t": 0.01 * np.arange(len(U)), "U": U, "w": noisy}))
    system = system_of(FAN.replace("DRY", str(dry)), tmp_path)
    logs = logs_of(system, tmp_path / "logs", tables)
    place, time, switch = ENDS[family]
    before = told(system, logs, Said(family, place, {time: 0.06, switch: 1.0}))
    (effect,) = with_moved_lags(before).effects
    (other,) = {*ENDS} - {family}
    sites = {found.site for found in effect.indistinguishable}
    assert ((other, ENDS[other][0].channel) in sites) is linear


def test_other_effects_stay_as_they_are(tmp_path: Path) -> None:
    t = 0.01 * np.arange(200)
    table = pd.DataFrame({"t": t, "U": np.sin(3.0 * t), "w": np.sin(3.0 * t - 0.5)})
    system = system_of(FAN.replace("DRY", "0.1"), tmp_path)
    logs = logs_of(system, tmp_path / "logs", [table] * 4)
    before = told(system, logs, Said("viscous_friction", Place("port", "shaft"), {"d": 0.1}))
    assert with_moved_lags(before) is before
