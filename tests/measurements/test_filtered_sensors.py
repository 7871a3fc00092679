"""A quantity is read from the log of a low-pass filtered sensor, and windows start at it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from tests.diagnosis.benches import pendulum
from tests.diagnosis.studies import ANGLE, effect
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.effects.added import with_numbers
from unmodelled.effects.scales import Scales
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.logs.readings import readings
from unmodelled.systems.model import System

PERIOD, TIME, RATE = 0.002, 0.02, 6.0


@pytest.fixture
def filtered(tmp_path: Path) -> tuple[System, Logs]:
    """A pendulum whose angle, sin(RATE*t), passes a filter of the time constant TIME, and its logs."""
    t = PERIOD * np.arange(1000)
    shown = np.sin(RATE * t - np.arctan(RATE * TIME)) / np.hypot(1.0, RATE * TIME)
    known = pendulum(tmp_path)
    (tmp_path / "logs").mkdir()
    for name in ("a", "b"):
        pd.DataFrame({"t": t, "theta": shown, "torque": 0.0}).to_csv(
            tmp_path / "logs" / f"{name}.csv", index=False
        )
    table = pd.DataFrame({"id": ["a", "b"], "file": ["a.csv", "b.csv"]})
    table.to_csv(tmp_path / "logs" / "experiments.csv", index=False)
    logs = read_logs(tmp_path / "logs", known)
    sizes = Scales.measured(known, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)
    added = effect("sensor_lag").add(known, ANGLE, sizes)
    return with_numbers(added.system, [added], {"c_y": 1.0, "T_y": TIME}), logs


def test_a_filtered_angle_and_its_speed_are_read_as_they_were(
    filtered: tuple[System, Logs], tmp_path: Path
) -> None:
    grown, _ = filtered
    logs = read_logs(tmp_path / "logs", grown)
    inner = slice(50, 950)
    assert_allclose(logs.x[inner, 0], np.sin(RATE * logs.t[inner]), atol=1e-4)
    assert_allclose(logs.x[inner, 1], RATE * np.cos(RATE * logs.t[inner]), atol=1e-2)
    assert_allclose(logs.x[inner, 2], logs.y[inner, 0], atol=1e-3)


def test_windows_start_at_the_angle_before_the_filter(filtered: tuple[System, Logs]) -> None:
    grown, logs = filtered
    simulation = Simulation(grown, Recording.of(logs, 0.1))
    values = simulation.values[None, None]
    tables = simulation.reader(np.repeat(values, 2, axis=0), simulation.recording)
    assert_allclose(tables.x[0, 100:900, 0], np.sin(RATE * logs.t[100:900]), atol=1e-4)
    assert_allclose(tables.x[0, 100:900, 1], RATE * np.cos(RATE * logs.t[100:900]), atol=0.02 * RATE)


def test_without_the_filter_the_output_is_read_as_it_is(filtered: tuple[System, Logs]) -> None:
    grown, logs = filtered
    simulation = Simulation(grown.with_values({"c_y": 0.0}), Recording.of(logs, 0.1))
    tables = simulation.reader(np.repeat(simulation.values[None, None], 2, axis=0), simulation.recording)
    assert_allclose(tables.x[0, :, 0], logs.y[:, 0])


def test_a_state_that_follows_another_one_is_read_from_its_own_output(filtered: tuple[System, Logs]) -> None:
    grown, _ = filtered
    (output,) = grown.outputs
    own = replace(grown, outputs=(replace(output, expression=grown.x[2]),))
    assert [(r.state, r.lag) for r in readings(own)] == [(2, 0)]
