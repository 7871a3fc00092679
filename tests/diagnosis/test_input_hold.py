"""Inputs that a digital controller holds between samples are told from those that run straight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import unmodelled
from tests.machines.folders import diagnosed, write_runs

MOTOR = """
schema: system/1
name: motor
states: {i: {unit: A}, w: {unit: rad/s}}
inputs: {u: {unit: V}}
outputs: {i: {unit: A}, w: {unit: rad/s}}
parameters:
  R: {value: 1.0, unit: ohm, identify: true, bounds: [0.5, 2]}
  L: {value: 2.0e-3, unit: H}
  k: {value: 0.05, unit: V s/rad}
  J: {value: 1.5e-4, unit: kg m^2, identify: true, bounds: [5.0e-5, 5.0e-4]}
ports: {shaft: {effort: T, unit: N m, velocity: w}}
dynamics: {i: (u - R*i - k*w)/L, w: (k*i - T)/J}
"""
PERIOD, SAMPLES, RUNS, SUBSTEPS = 2e-3, 400, 6, 10


def logs(folder: Path, held: bool) -> Path:
    """Runs of a motor with dry friction whose current is as fast as a sample."""
    rng, tables = np.random.default_rng(4), []
    for _ in range(RUNS):
        t = PERIOD * np.arange(SAMPLES)
        square = np.sign(np.sin(2 * np.pi * rng.uniform(2.0, 5.0) * t))
        u = rng.uniform(4.0, 10.0) * np.sin(2 * np.pi * rng.uniform(0.5, 2.0) * t) + 3.0 * square
        x, seen, h = np.zeros(2), [], PERIOD / SUBSTEPS
        for now, after in zip(u, np.append(u[1:], u[-1]), strict=True):
            seen.append(x)
            for step in range(SUBSTEPS):
                volts = now if held else now + (after - now) * step / SUBSTEPS
                torque = 0.05 * x[0] - 0.012 * np.tanh(x[1] / 0.5)
                x = x + h * np.array([(volts - 1.1 * x[0] - 0.05 * x[1]) / 2e-3, torque / 1.5e-4])
        i, w = np.array(seen).T
        noisy = {"i": i + 0.01 * rng.normal(size=SAMPLES), "w": w + 0.1 * rng.normal(size=SAMPLES)}
        tables.append({"t": t, "u": u, **noisy})
    return write_runs(folder, tables)


@pytest.mark.long
@pytest.mark.parametrize("held", [True, False], ids=["held", "straight"])
def test_the_course_of_an_input_is_chosen_and_nothing_stands_in_for_it(tmp_path: Path, held: bool) -> None:
    answer = diagnosed(tmp_path, MOTOR, logs(tmp_path / "logs", held))
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "coulomb_friction", "shaft")
    assert effect.parameters["F_c"]["value"] == pytest.approx(0.012, rel=0.03)
    assert any("inputs keep their values" in note for note in answer.notes) == held
    answer.save(tmp_path / "answer")
    written = unmodelled.read_system(tmp_path / "answer" / "augmented_system.yaml")
    assert written.inputs[0].hold == held
