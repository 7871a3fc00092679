"""Planted effects in small machines whose known physics is stiff, swings, or hides which law bends it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from tests.machines.folders import diagnosed, write_runs

pytestmark = pytest.mark.long
Random = np.random.Generator

COIL = """
schema: system/1
name: coil
states: {i: {unit: A}}
inputs: {U: {unit: V}}
outputs: {i: {unit: A}}
parameters:
  R: {value: 4.2, unit: ohm, identify: true, bounds: [1, 10]}
  L: {value: 0.5, unit: H, identify: true, bounds: [0.05, 5]}
ports: {winding: {effort: u_x, unit: V, velocity: i}}
dynamics: {i: (U - R*i - u_x)/L}
"""
CYLINDER = """
schema: system/1
name: cylinder
states: {x: {unit: m}, v: {unit: m/s}}
inputs: {u: {unit: V}}
outputs: {x: {unit: m}}
parameters:
  K: {value: 0.07, unit: m/(s V), identify: true, bounds: [0.01, 0.3]}
  tau: {value: 0.08, unit: s, identify: true, bounds: [0.01, 0.5]}
  m: {value: 100, unit: kg}
ports: {rod: {effort: F_x, unit: N, position: x, velocity: v}}
dynamics: {x: v, v: (K*u - v)/tau - F_x/m}
"""
TWO_MASSES = """
schema: system/1
name: two_masses
states: {a: {unit: rad}, w_a: {unit: rad/s}, b: {unit: rad}, w_b: {unit: rad/s}}
inputs: {M: {unit: N m}}
outputs: {a: {unit: rad}, b: {unit: rad}}
parameters:
  J_a: {value: 0.002, unit: kg m^2}
  J_b: {value: 0.005, unit: kg m^2, identify: true, bounds: [0.001, 0.03]}
  k: {value: 50, unit: N m/rad, identify: true, bounds: [10, 300]}
  d: {value: 0.02, unit: N m s/rad, identify: true, bounds: [0, 0.5]}
  d_a: {value: 0.01, unit: N m s/rad, identify: true, bounds: [0, 0.2]}
  d_b: {value: 0.01, unit: N m s/rad, identify: true, bounds: [0, 0.2]}
signals: {s: k*(a - b) + d*(w_a - w_b)}
ports:
  motor: {effort: M_a, unit: N m, position: a, velocity: w_a}
  load: {effort: M_b, unit: N m, position: b, velocity: w_b}
dynamics:
  a: w_a
  w_a: (M - s - d_a*w_a - M_a)/J_a
  b: w_b
  w_b: (s - d_b*w_b - M_b)/J_b
"""


def steps(levels: list[float], hold: float, duration: float, rng: Random) -> Callable[[object], np.ndarray]:
    """A signal that takes a random level every `hold` seconds."""
    values = rng.choice(levels, int(duration / hold) + 2)
    return lambda t: values[np.minimum((np.asarray(t) / hold).astype(int), len(values) - 1)]


def simulated(rate: Callable, start: list[float], t: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    return np.asarray(
        solve_ivp(rate, (0.0, t[-1]), start, "LSODA", t, rtol=1e-7, atol=1e-9, max_step=0.5 * t[1]).y
    )


def hot_coil(rng: Random) -> pd.DataFrame:
    """A current without inertia through copper that warms up within 40 s."""
    u, t = steps([0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0], 30.0, 400.0, rng), np.arange(0.0, 400.0, 0.5)

    def current(t: object, warmer: np.ndarray) -> np.ndarray:
        return u(t) / (4.0 * (1.0 + 0.0039 * warmer))

    def rate(t: float, x: np.ndarray) -> list[float]:
        return [(u(t) * float(current(t, x[0])) - 0.35 * x[0]) / 14.0]

    i = current(t, simulated(rate, [0.0], t)[0]) + 0.003 * rng.standard_normal(len(t))
    return pd.DataFrame({"t": t, "U": u(t) + 0.005 * rng.standard_normal(len(t)), "i": np.round(i, 3)})


def dead_valve(rng: Random) -> pd.DataFrame:
    """A cylinder in a position loop, whose valve does nothing below 0.35 V."""
    goal, t, gain = (
        steps([0.1, 0.2, 0.3, 0.4], 1.7, 20.0, rng),
        np.arange(0.0, 20.0, 0.01),
        rng.normal(0.08, 0.003),
    )
    x, u, here, v = np.zeros(len(t)), np.zeros(len(t)), 0.2, 0.0
    for k, aim in enumerate(goal(t)):
        x[k], u[k] = here, np.clip(12.0 * (aim - here), -3.0, 3.0)
        for _ in range(5):
            v += 0.002 * (gain * np.sign(u[k]) * max(abs(u[k]) - 0.35, 0.0) - v) / 0.06
            here += 0.002 * v
    seen = np.round((x + 2e-5 * rng.standard_normal(len(t))) / 1e-4) * 1e-4
    return pd.DataFrame({"t": t, "u": u, "x": seen})


def rubbing_load(rng: Random) -> pd.DataFrame:
    """Two masses that swing against each other at 33 Hz, the second one with dry friction."""
    torque, t = steps([-1.5, -0.8, -0.3, 0.0, 0.3, 0.8, 1.5], 0.25, 5.0, rng), np.arange(0.0, 5.0, 0.002)

    def rate(t: float, x: np.ndarray) -> list[float]:
        s = 60.0 * (x[0] - x[2]) + 0.02 * (x[1] - x[3])
        rub = 0.2 * np.tanh(x[3] / 0.05) + 0.005 * x[3]
        return [x[1], (float(torque(t)) - s - 0.01 * x[1]) / 0.002, x[3], (s - rub) / 0.006]

    x, count = simulated(rate, [0.0, 0.0, 0.0, 0.0], t), 2.0 * np.pi / 10_000
    noisy = torque(t) + 0.01 * rng.standard_normal(len(t))
    return pd.DataFrame(
        {"t": t, "M": noisy, "a": np.floor(x[0] / count) * count, "b": np.floor(x[2] / count) * count}
    )


def recorded(folder: Path, measure: Callable[[Random], pd.DataFrame], runs: int) -> Path:
    rng = np.random.default_rng(0)
    return write_runs(folder, [measure(rng) for _ in range(runs)])


def test_heat_of_a_coil_whose_inductance_is_given_ten_times_too_large(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, COIL, recorded(tmp_path / "logs", hot_coil, 6))
    (effect,) = answer.effects
    assert (effect.family, effect.port) == ("self_heating", "winding")
    assert effect.parameters["tau_h"]["value"] == pytest.approx(14.0 / 0.35, rel=0.3)
    gap = answer.gaps.set_index("model")["gap"]
    assert gap["augmented"] < 0.2 * gap["reidentified"]


def test_a_dead_zone_is_not_called_dry_friction(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, CYLINDER, recorded(tmp_path / "logs", dead_valve, 7))
    assert (answer.effects[0].family, answer.effects[0].port) == ("actuator_dead_zone", "actuator:u")


def test_the_spring_between_two_masses_is_not_driven_to_its_bound(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, TWO_MASSES, recorded(tmp_path / "logs", rubbing_load, 8))
    assert (answer.effects[0].family, answer.effects[0].port) == ("coulomb_friction", "load")
    assert answer.parameters.set_index("name").loc["k", "identified"] == pytest.approx(60.0, rel=0.05)
