"""Planted laws of a drive: a limit that falls with speed, a gain that falls, friction that warms up."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from tests.machines.folders import diagnosed, write_runs
from unmodelled.api.answer import Answer

pytestmark = pytest.mark.long
Array = NDArray[np.float64]
#: Torque of all runs at a current (A), a speed (rad/s) and a time (s), in N m.
Torque = Callable[[Array, Array, float], Array]

DRIVE = """
schema: system/1
name: drive
states: {phi: {unit: rad}, w: {unit: rad/s}}
inputs: {i: {unit: A}}
outputs: {phi: {unit: rad}, w: {unit: rad/s}}
parameters:
  J: {value: 0.02, unit: kg m^2}
  d: {value: 0.05, unit: N m s/rad, identify: true, bounds: [0.005, 0.5]}
  k_m: {value: 0.5, unit: N m/A, identify: true, bounds: [0.2, 1]}
ports: {shaft: {effort: T, unit: N m, position: phi, velocity: w}}
dynamics: {phi: w, w: (k_m*i - d*w - T)/J}
"""
PERIOD, SAMPLES, RUNS, SUBSTEPS, NOISE = 4e-3, 350, 4, 6, (1e-4, 2e-3)
#: V, ohm and V s/rad of the voltage-driven motor: at rest 3.2 A, none at 14 rad/s. A, the limit of its drive.
SUPPLY, RESISTANCE, BACK_EMF, LARGEST = 24.0, 7.5, 24.0 / 14.0, 3.2


def limited_by_voltage(i: Array, w: Array, t: float) -> Array:
    most, least = (SUPPLY - BACK_EMF * w) / RESISTANCE, (-SUPPLY - BACK_EMF * w) / RESISTANCE
    acting = np.clip(i, np.maximum(least, -LARGEST), np.minimum(most, LARGEST))
    return 0.52 * acting - 0.052 * w


def limited_in_power(i: Array, w: Array, t: float) -> Array:
    """The drive gives 2.5 A up to 4 rad/s, and a constant power above."""
    most = 2.5 * 4.0 / np.maximum(np.abs(w), 4.0)
    return 0.52 * np.clip(i, -most, most) - 0.052 * w


def saturating_iron(i: Array, w: Array, t: float) -> Array:
    return 0.52 * i / (1.0 + 0.08 * np.abs(i)) - 0.052 * w


def warming_up(i: Array, w: Array, t: float) -> Array:
    dry = 0.1 + 0.3 * np.exp(-t / 2.0)
    return 0.52 * i - 0.052 * w - dry * np.tanh(w / 0.05)


def driven(folder: Path, torque: Torque) -> Answer:
    rng, t, h = np.random.default_rng(5), PERIOD * np.arange(SAMPLES), PERIOD / SUBSTEPS
    rate, phase = rng.uniform(1.5, 12.0, (3, RUNS)), rng.uniform(0.0, 6.28, (3, RUNS))
    size = rng.uniform(1.0, 2.0, RUNS)

    def current(s: float) -> Array:
        return np.asarray(size * np.sin(rate * s + phase).sum(0))

    phi, w, path = np.zeros(RUNS), np.zeros(RUNS), []
    for k in range(SAMPLES):
        path.append((current(t[k]), phi, w))
        for s in t[k] + h * np.arange(SUBSTEPS):
            middle = w + 0.5 * h * torque(current(s), w, s) / 0.02
            w, phi = w + h * torque(current(s + 0.5 * h), middle, s + 0.5 * h) / 0.02, phi + h * middle
    seen = np.array(path).transpose(2, 1, 0)
    seen[:, 1:] += np.array(NOISE)[:, None] * rng.standard_normal((RUNS, 2, SAMPLES))
    recorded = write_runs(
        folder / "logs", [pd.DataFrame({"t": t, "i": i, "phi": x, "w": v}) for i, x, v in seen]
    )
    return diagnosed(folder, DRIVE, recorded)


def test_the_limit_of_a_motor_falls_with_its_speed(tmp_path: Path) -> None:
    answer = driven(tmp_path, limited_by_voltage)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "actuator_saturation", "actuator:i")
    assert effect.parameters["u_0"]["value"] == pytest.approx(SUPPLY / RESISTANCE, rel=0.01)
    assert effect.parameters["v_0"]["value"] == pytest.approx(SUPPLY / BACK_EMF, rel=0.01)
    assert [effect.parameters[name]["unit"] for name in ("u_0", "v_0")] == ["A", "rad/s"]


def test_the_power_of_a_drive_is_limited(tmp_path: Path) -> None:
    answer = driven(tmp_path, limited_in_power)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "actuator_saturation", "actuator:i")
    assert effect.law == "clip(i, -u_0*v_b/max(abs(w), v_b), u_0*v_b/max(abs(w), v_b))"
    assert effect.parameters["u_0"]["value"] == pytest.approx(2.5, rel=0.01)
    assert effect.parameters["v_b"]["value"] == pytest.approx(4.0, rel=0.01)


def test_the_torque_constant_falls_with_the_current(tmp_path: Path) -> None:
    answer = driven(tmp_path, saturating_iron)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "actuator_saturation", "actuator:i")
    assert effect.law == "i - s_u*i*abs(i)"
    # between the slope of the gain at rest and that of the chord at the largest current, 5 A
    assert 0.08 / 1.4 - 0.01 < effect.parameters["s_u"]["value"] < 0.08
    assert effect.parameters["s_u"]["unit"] == "1/A"


def test_dry_friction_falls_as_the_machine_warms_up(tmp_path: Path) -> None:
    answer = driven(tmp_path, warming_up)
    assert answer.verdict == "effect"
    friction, drift = answer.effects
    # a Stribeck part of next to nothing may stand beside the constant part
    assert friction.family in ("coulomb_friction", "stribeck_friction")
    assert (drift.family, drift.port) == ("drift", "shaft")
    assert friction.parameters["F_c"]["value"] == pytest.approx(0.4, rel=0.03)
    mean = 0.3 * (np.exp(-SAMPLES * PERIOD / 2.0) - 1.0) / (SAMPLES * PERIOD)
    assert drift.parameters["F_t"]["value"] == pytest.approx(mean, rel=0.1)
