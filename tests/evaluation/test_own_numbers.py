"""Numbers that every experiment has for itself, in experiments that the system file does not list."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import unmodelled as um
from tests.evaluation.gap_systems import clock
from tests.machines.folders import logs_of, system_of
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.own_numbers import with_own_numbers
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

DRAG = """
schema: system/1
name: sled
states: {v: {unit: m/s}}
inputs: {F: {unit: N}}
outputs: {v: {unit: m/s}}
operating_point: {b: {unit: N s/m, values: {run0: 1.0, run1: 1.2, run2: 0.8}, other: 1.0, FITTED}}
parameters: {m: {value: 2.0, unit: kg}}
dynamics: {v: (F - b*v)/m}
"""
GIVEN, NEW = (1.0, 1.2, 0.8), (0.6, 1.5)
SIGMA = 0.002


def sled(folder: Path, fitted: str = "identify: true, bounds: [0, 3]") -> System:
    return system_of(DRAG.replace("FITTED", fitted), folder)


def campaign(system: System, folder: Path, still: bool = False) -> Logs:
    """Five sleds with a drag each, by the closed form of a constant force and a start at rest."""
    rng, experiments = np.random.default_rng(1), []
    for i, b in enumerate((*GIVEN, *NEW)):
        t = clock(600, 0.01)
        force = 0.0 if still and i >= len(GIVEN) else 3.0 + 0.5 * i
        v = force / b * (1.0 - np.exp(-b / 2.0 * t))
        noise = SIGMA * rng.standard_normal(len(t))
        experiments.append({"t": t, "v": v + noise, "F": np.full(len(t), force)})
    return logs_of(system, folder, experiments)


def test_experiments_that_are_not_listed_get_their_number_from_their_first_half(tmp_path: Path) -> None:
    system = sled(tmp_path)
    logs = campaign(system, tmp_path / "logs")
    assert logs.c[:, 0].tolist() == [*GIVEN, 1.0, 1.0]
    found = with_own_numbers(system, logs, 0.5)
    assert found.c[:3, 0].tolist() == list(GIVEN)
    assert found.c[3:, 0] == pytest.approx(NEW, abs=0.01)
    assert found.experiments["b"].tolist() == found.c[:, 0].tolist()
    (note,) = [note for note in found.notes if note.startswith("b: ")]
    assert "fitted to the first half of 2 experiments" in note
    assert any(note.startswith("b: 2 of 5 experiments") for note in logs.notes)
    before, after = free_runs(system, logs, 0.5), free_runs(system, found, 0.5)
    assert after.value < 1.3 * after.floor < 0.1 * before.value
    # the second half is not seen
    t_half = logs.offsets[3] + 300
    other = logs.y.copy()
    other[t_half : logs.offsets[4]] += 1.0
    spoilt = with_own_numbers(system, replace(logs, y=other), 0.5, runs=[3])
    assert spoilt.c[3, 0] == pytest.approx(NEW[0], abs=0.02)
    assert spoilt.c[4, 0] == 1.0


def test_without_motion_the_number_is_that_of_the_others(tmp_path: Path) -> None:
    system = sled(tmp_path)
    found = with_own_numbers(system, campaign(system, tmp_path / "logs", still=True), 0.5)
    assert found.c[3:, 0] == pytest.approx(1.0, abs=0.1)


def test_without_identify_nothing_is_fitted(tmp_path: Path) -> None:
    system = sled(tmp_path, "")
    logs = campaign(system, tmp_path / "logs")
    assert with_own_numbers(system, logs, 0.5) is logs
    assert um.simulate(system, logs).value > 0.1


def test_simulate_fits_them(tmp_path: Path) -> None:
    system = sled(tmp_path)
    found = um.simulate(system, campaign(system, tmp_path / "logs"))
    assert found.value < 1.3 * found.floor
    note = "note: b: fitted to the first half of 2 experiments that the system file does not list"
    assert note in repr(found)
