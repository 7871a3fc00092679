"""Planted effects in small machines whose known physics is stiff, swings, or hides which law bends it."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import Array, diagnosed, motion, recorded, text_of

pytestmark = pytest.mark.long
Random = np.random.Generator


def steps(levels: list[float], hold: int, t: Array, rng: Random) -> Array:
    """A signal that takes a random level every `hold` samples."""
    return np.repeat(rng.choice(levels, len(t) // hold + 2), hold)[: len(t)]


def hot_coil(rng: Random) -> pd.DataFrame:
    """A current without inertia through copper that warms up within 40 s."""
    t = np.arange(0.0, 400.0, 0.5)
    u = steps([0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0], 60, t, rng)
    current = lambda u, warmer: u / (4.0 * (1.0 + 0.0039 * warmer))  # noqa: E731
    rates = lambda x, u: (u * current(u, x) - 0.35 * x) / 14.0  # noqa: E731
    i = current(u, motion(rates, [0.0], u, 0.5, held=True)[:, 0]) + 0.003 * rng.standard_normal(len(t))
    return pd.DataFrame({"t": t, "U": u + 0.005 * rng.standard_normal(len(t)), "i": np.round(i, 3)})


def dead_valve(rng: Random) -> pd.DataFrame:
    """A cylinder in a position loop, whose valve does nothing below 0.35 V."""
    t = np.arange(0.0, 20.0, 0.01)
    goal, gain = steps([0.1, 0.2, 0.3, 0.4], 170, t, rng), rng.normal(0.08, 0.003)
    x, u, here, v = np.zeros(len(t)), np.zeros(len(t)), 0.2, 0.0
    for k, aim in enumerate(goal):
        x[k], u[k] = here, np.clip(12.0 * (aim - here), -3.0, 3.0)
        for _ in range(5):
            v += 0.002 * (gain * np.sign(u[k]) * max(abs(u[k]) - 0.35, 0.0) - v) / 0.06
            here += 0.002 * v
    seen = np.round((x + 2e-5 * rng.standard_normal(len(t))) / 1e-4) * 1e-4
    return pd.DataFrame({"t": t, "u": u, "x": seen})


def rubbing_load(rng: Random) -> pd.DataFrame:
    """Two masses that swing against each other at 33 Hz, the second one with dry friction."""
    t = np.arange(0.0, 5.0, 0.002)
    torque = steps([-1.5, -0.8, -0.3, 0.0, 0.3, 0.8, 1.5], 125, t, rng)

    def rates(x: Array, torque: Array) -> list[Array]:
        s = 60.0 * (x[0] - x[2]) + 0.02 * (x[1] - x[3])
        rub = 0.2 * np.tanh(x[3] / 0.05) + 0.005 * x[3]
        return [x[1], (torque - s - 0.01 * x[1]) / 0.002, x[3], (s - rub) / 0.006]

    x, count = motion(rates, np.zeros(4), torque, 0.002, held=True).T, 2.0 * np.pi / 10_000
    seen = np.floor(x / count) * count
    noisy = torque + 0.01 * rng.standard_normal(len(t))
    return pd.DataFrame({"t": t, "M": noisy, "a": seen[0], "b": seen[2]})


def test_heat_of_a_coil_whose_inductance_is_given_ten_times_too_large(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, text_of("hot_coil.yaml"), recorded(tmp_path / "logs", hot_coil, 6))
    (effect,) = answer.effects
    assert (effect.family, effect.port) == ("self_heating", "winding")
    assert effect.parameters["tau_h"]["value"] == pytest.approx(14.0 / 0.35, rel=0.3)
    gap = answer.gaps.set_index("model")["gap"]
    assert gap["augmented"] < 0.2 * gap["reidentified"]


def test_a_dead_zone_is_not_called_dry_friction(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, text_of("cylinder.yaml"), recorded(tmp_path / "logs", dead_valve, 7))
    assert (answer.effects[0].family, answer.effects[0].port) == ("actuator_dead_zone", "actuator:u")


def test_the_spring_between_two_masses_is_not_driven_to_its_bound(tmp_path: Path) -> None:
    logs = recorded(tmp_path / "logs", rubbing_load, 8)
    answer = diagnosed(tmp_path, text_of("damped_two_masses.yaml"), logs)
    assert (answer.effects[0].family, answer.effects[0].port) == ("coulomb_friction", "load")
    assert answer.parameters.set_index("name").loc["k", "identified"] == pytest.approx(60.0, rel=0.05)
