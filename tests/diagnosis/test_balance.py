"""Planted losses and stores of a house, a tank and a battery: named, with their numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

import unmodelled
from tests.machines.folders import diagnosed, write_runs

Array = NDArray[np.float64]

HOUSE = """
schema: system/1
name: house
states:
  T: {unit: K}
inputs:
  P: {unit: W}
outputs:
  T: {unit: K}
parameters:
  C: {value: 2.3e+6, unit: J/K, identify: true, bounds: [5.0e+5, 1.0e+7]}
ports:
  air: {effort: q, unit: W, position: T}
dynamics:
  T: (P - q)/C
"""
#: The store is in the file; the temperature at which it starts is not known.
WALLED = """
schema: system/1
name: walled_house
states:
  T: {unit: K}
  T_w: {unit: K, initial: {value: 290, identify: true, bounds: [270, 310], per_experiment: true}}
inputs:
  P: {unit: W}
outputs:
  T: {unit: K}
parameters:
  C: {value: 9.0e+5, unit: J/K, identify: true, bounds: [5.0e+5, 2.0e+6]}
  C_w: {value: 6.0e+6, unit: J/K}
  k_w: {value: 400, unit: W/K}
ports:
  air: {effort: q, unit: W, position: T}
dynamics:
  T: (P - k_w*(T - T_w) - q)/C
  T_w: k_w*(T - T_w)/C_w
"""
TANK = """
schema: system/1
name: tank
states:
  h: {unit: m}
inputs:
  q_in: {unit: m^3/s}
outputs:
  h: {unit: m}
parameters:
  A: {value: 0.5, unit: m^2}
  k: {value: 0.023, unit: m^2.5/s, identify: true, bounds: [0.005, 0.1]}
ports:
  vessel: {effort: q, unit: m^3/s, position: h}
dynamics:
  h: (q_in - k*sqrt(max(h, 0)) - q)/A
"""
BATTERY = """
schema: system/1
name: battery
states:
  v: {unit: V}
inputs:
  i: {unit: A}
outputs:
  U: {unit: V, expression: v - R*i}
parameters:
  C: {value: 4.0e+3, unit: F, identify: true, bounds: [1.0e+3, 2.0e+4]}
  R: {value: 0.02, unit: ohm, identify: true, bounds: [0.005, 0.1]}
ports:
  cell: {effort: i_x, unit: A, position: v}
dynamics:
  v: (-i - i_x)/C
"""
RUNS, SAMPLES = 8, 300


def logs(
    folder: Path, names: tuple[str, str], period: float, levels: list[float], start: tuple[float, float],
    rate: Callable[..., list[float]], noise: float, stores: int = 0, series: float = 0.0,
    below: Sequence[float] = (0.0,) * RUNS, ambient: str = "",
) -> Path:  # fmt: skip
    """A folder of runs with steps of the input, integrated in ten substeps per sample.

    The states of `rate` are the level and `stores` others, which start `below` it in every run; `series`
    times the input is taken from what is logged. Where `ambient` is the name of a column, `rate` also gets
    this temperature, which rises and falls.
    """
    rng, tables = np.random.default_rng(0), []
    for run in range(RUNS):
        u = np.repeat(rng.choice(levels, SAMPLES // 30), 30)
        x = [rng.uniform(*start) - below[run] * (np.arange(1 + stores) > 0)]
        around = rng.uniform(274.0, 280.0) + 5.0 * np.sin(0.03 * np.arange(SAMPLES) + run)
        inputs = np.column_stack([u, *([around] if ambient else [])])
        for before, after in pairwise(inputs):
            state = x[-1]
            for k in range(10):
                now = [before[0], *(before[1:] + 0.1 * k * (after[1:] - before[1:]))]
                state = state + 0.1 * period * np.array(rate(*state, *map(float, now)))
            x.append(state)
        seen = np.array(x)[:, 0] - series * u + noise * rng.standard_normal(SAMPLES)
        table = {"t": period * np.arange(SAMPLES), names[0]: u, names[1]: seen}
        tables.append(pd.DataFrame(table | ({ambient: around} if ambient else {})))
    return write_runs(folder, tables)


@pytest.mark.long
def test_the_heat_that_a_house_loses_to_its_surroundings(tmp_path: Path) -> None:
    recorded = logs(
        *(tmp_path / "logs", ("P", "T"), 120.0, [0.0, 1500.0, 3000.0, 4500.0], (285.0, 297.0)),
        lambda T, P: [(P - 120.0 * (T - 278.0)) / 2.0e6],
        0.02,
    )
    answer = diagnosed(tmp_path, HOUSE, recorded)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "linear_loss", "air")
    assert effect.parameters["k"]["value"] == pytest.approx(120.0, rel=0.02)
    assert effect.parameters["k"]["unit"] == "W/K"
    assert effect.parameters["x_a"]["value"] == pytest.approx(278.0, abs=0.3)


@pytest.mark.long
def test_the_heat_that_a_house_loses_to_a_logged_temperature(tmp_path: Path) -> None:
    outdoors = HOUSE.replace("P: {unit: W}", "P: {unit: W}\n  T_out: {unit: K, commanded: false}")
    recorded = logs(
        *(tmp_path / "logs", ("P", "T"), 120.0, [0.0, 1500.0, 3000.0, 4500.0], (285.0, 297.0)),
        lambda T, P, T_out: [(P - 120.0 * (T - T_out)) / 2.0e6],
        0.02,
        ambient="T_out",
    )
    answer = diagnosed(tmp_path, outdoors, recorded)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "linear_loss", "air")
    assert effect.law == "k*(T - T_out)"
    assert effect.parameters["k"]["value"] == pytest.approx(120.0, rel=0.02)


@pytest.mark.long
def test_a_loss_that_grows_with_a_fan_of_which_the_equations_know_nothing(tmp_path: Path) -> None:
    """The column has the name and the numbers of a fan's speed, 1/min."""
    cooled = HOUSE.replace("P: {unit: W}", "P: {unit: W}\n  fan: {unit: 1/min, commanded: false}").replace(
        "(P - q)/C", "(P - G*(T - 280) - q)/C"
    )
    cooled = cooled.replace(
        "ports:", "  G: {value: 90, unit: W/K, identify: true, bounds: [10, 500]}\nports:"
    )
    recorded = logs(
        *(tmp_path / "logs", ("P", "T"), 120.0, [0.0, 1500.0, 3000.0, 4500.0], (285.0, 297.0)),
        lambda T, P, fan: [(P - (80.0 + 5.0 * (fan - 270.0)) * (T - 280.0)) / 2.0e6],
        0.02,
        ambient="fan",
    )
    answer = diagnosed(tmp_path, cooled, recorded)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "input_dependence", "air")
    (slope,) = effect.parameters.values()
    assert slope["value"] == pytest.approx(5.0 * 60.0, rel=0.02)  # per 1/s
    assert effect.law.startswith("G + G_per_fan*(fan - ")


@pytest.mark.long
def test_the_overflow_of_a_tank(tmp_path: Path) -> None:
    recorded = logs(
        *(tmp_path / "logs", ("q_in", "h"), 1.0, [0.0, 0.01, 0.02, 0.03, 0.05], (0.3, 1.0)),
        lambda h, q: [(q - 0.02 * max(h, 0.0) ** 0.5 - 0.3 * max(h - 1.2, 0.0) ** 1.5) / 0.5],
        0.001,
    )
    answer = diagnosed(tmp_path, TANK, recorded)
    assert answer.verdict in ("effect", "main_effect")
    assert (answer.effects[0].family, answer.effects[0].port) == ("overflow", "vessel")
    assert answer.effects[0].parameters["x_o"]["value"] == pytest.approx(1.2, abs=0.06)
    assert answer.effects[0].shrink > 0.9


@pytest.mark.long
def test_a_house_with_walls_that_store_heat(tmp_path: Path) -> None:
    """Two effects at one port: what leaves the house, and what its walls take and return."""
    recorded = logs(
        *(tmp_path / "logs", ("P", "T"), 120.0, [0.0, 1500.0, 3000.0, 4500.0], (285.0, 297.0)),
        lambda T, wall, P: [
            (P - 400.0 * (T - wall) - 60.0 * (T - 278.0)) / 8.0e5,
            400.0 * (T - wall) / 6.0e6,
        ],
        *(0.02, 1),
    )
    answer = diagnosed(tmp_path, HOUSE, recorded)
    found = {effect.family: [n["value"] for n in effect.parameters.values()] for effect in answer.effects}
    assert set(found) == {"storage", "linear_loss"}
    assert found["storage"] == pytest.approx([400.0, 6.0e6 / 400.0], rel=0.03)
    assert found["linear_loss"] == pytest.approx([60.0, 278.0], rel=0.1)


@pytest.mark.long
def test_the_slow_charge_of_a_battery(tmp_path: Path) -> None:
    """The voltage at the terminals shows the charge beside the drop at a resistance that is fitted.

    A second capacitor behind a conductance is at the terminals what an RC branch in series is.
    """
    recorded = logs(
        *(tmp_path / "logs", ("i", "U"), 1.0, [-10.0, 0.0, 0.0, 5.0, 10.0, 20.0], (3.5, 3.7)),
        lambda v, slow, i: [(-i - 60.0 * (v - slow)) / 3.0e3, 60.0 * (v - slow) / 6.0e3],
        *(0.0005, 1, 0.015),
    )
    answer = diagnosed(tmp_path, BATTERY, recorded)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "rc_branch", "sensor:U")
    assert effect.indistinguishable == ("storage at cell",)
    assert effect.parameters["tau_1"]["value"] == pytest.approx(2000.0 / 60.0, rel=0.02)
    assert effect.parameters["R_1"]["value"] == pytest.approx(-((6.0 / 9.0) ** 2) / 60.0, rel=0.03)
    assert answer.parameters["identified"].to_list() == pytest.approx([9000.0, 0.015], rel=0.02)


@pytest.mark.long
def test_walls_that_start_every_experiment_at_a_temperature_of_their_own(tmp_path: Path) -> None:
    """The start of a state that nothing measures is fitted in every experiment, and is no finding."""
    recorded = logs(
        *(tmp_path / "logs", ("P", "T"), 120.0, [0.0, 1500.0, 3000.0, 4500.0], (285.0, 297.0)),
        lambda T, wall, P: [
            (P - 400.0 * (T - wall) - 60.0 * (T - 278.0)) / 8.0e5,
            400.0 * (T - wall) / 6.0e6,
        ],
        *(0.02, 1),
        below=[1.0, -4.0, 3.0, 0.0, -2.0, 5.0, 2.0, -1.0],
    )
    answer = diagnosed(tmp_path, WALLED, recorded)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "linear_loss", "air")
    assert effect.parameters["k"]["value"] == pytest.approx(60.0, rel=0.1)
    (start,) = (c for c in answer.system.operating_point if c.name == "T_w_0")
    first = {run: float(pd.read_csv(recorded / f"{run}.csv")["T"].iloc[0]) for run in start.values}
    found = [first[run] - value for run, value in start.values.items()]
    assert found == pytest.approx([1.0, -4.0, 3.0, 0.0, -2.0, 5.0, 2.0, -1.0], abs=0.3)
    assert list(answer.parameters["name"]) == ["C"]
    again = unmodelled.simulate(answer.system, unmodelled.read_logs(recorded, answer.system))
    assert again.value < 0.02
