"""Planted laws of carts: written down where the library lacks them, at every cart, and behind a filter."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled
from tests.machines.folders import (
    Array,
    diagnosed,
    motion,
    only_effect,
    recorded,
    text_of,
    values_of,
    write_runs,
)

CART = text_of("cart_on_spring.yaml")
PERIOD, SAMPLES, RUNS = 0.01, 600, 8
Force = Callable[[float, float], float]


def record(folder: Path, force: Force, seed: int = 1) -> Path:
    """Sums of sines drive a cart of 2 kg on a spring."""
    t = PERIOD * np.arange(SAMPLES)

    def rates(x: Array, u: Array) -> list[float]:
        return [x[1], (u - 40.0 * x[0] - force(x[0], x[1])) / 2.0]

    def run(rng: np.random.Generator) -> pd.DataFrame:
        size, rate, phase = 4.0 * rng.normal(size=5), rng.uniform(0.1, 1.5, 5), rng.uniform(0.0, 6.3, 5)
        u = np.sin(2.0 * np.pi * rate * t[:, None] + phase) @ size
        path = motion(rates, [0.0, 0.0], u, PERIOD)
        x, v = (path + rng.standard_normal((SAMPLES, 2)) * [2e-4, 1e-3]).T
        return pd.DataFrame({"t": t, "u": u, "x": x, "v": v})

    return recorded(folder, run, RUNS, seed)


@pytest.mark.long
@pytest.mark.parametrize(
    ("force", "law", "numbers"),
    [
        (lambda x, v: 0.6 * v * abs(v) + 0.8 * v**3, "c_1*v*abs(v) + c_2*v**3", (0.6, 0.8)),
    ],
    ids=["drag"],
)
def test_a_law_that_the_library_lacks_is_written_down(
    force: Force, law: str, numbers: tuple[float, ...], tmp_path: Path
) -> None:
    answer = diagnosed(tmp_path, CART, record(tmp_path / "logs", force))
    effect = only_effect(answer, "discovered_law", "rail")
    assert effect.law == law
    assert values_of(effect) == pytest.approx(numbers, rel=0.02)


@pytest.mark.long
def test_a_law_of_the_library_is_named_as_such(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, CART, record(tmp_path / "logs", lambda x, v: 2.0 * v * abs(v)))
    assert [e.family for e in answer.effects] == ["quadratic_drag"]


#: Carts in a row with springs between them, whose file knows no friction; dry friction, N.
FILE = text_of("carts.yaml")
CARTS, STIFFNESS, MASS = 6, 60.0, 2.0
FRICTIONS = np.array([1.5, 0.8, 2.2, 1.1, 1.8, 0.6])


def record_carts(folder: Path) -> Path:
    """Sums of sines drive the carts; smooth sign of the speed."""
    t = PERIOD * np.arange(500)
    stiff = STIFFNESS * (2.0 * np.eye(CARTS) - np.eye(CARTS, k=1) - np.eye(CARTS, k=-1))

    def rates(x: Array, u: Array) -> list[Array]:
        return [x[1], (u - stiff @ x[0] - FRICTIONS * np.tanh(x[1] / 0.01)) / MASS]

    def run(rng: np.random.Generator) -> pd.DataFrame:
        size, speed = 5.0 * rng.normal(size=(CARTS, 4)), rng.uniform(1.0, 8.0, (CARTS, 4, 1))
        u = np.einsum("cs,cst->tc", size, np.sin(speed * t + rng.uniform(0.0, 6.3, (CARTS, 4, 1))))
        x = motion(rates, np.zeros((2, CARTS)), u, PERIOD)[:, 0]
        noisy = x + 2e-4 * rng.standard_normal((500, CARTS))
        names = [f"{name}{k + 1}" for name in "xu" for k in range(CARTS)]
        return pd.DataFrame(np.column_stack([t, noisy, u]), columns=["t", *names])

    return recorded(folder, run, RUNS, 3)


@pytest.mark.long
def test_dry_friction_of_six_carts_is_named_at_every_one(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, FILE, record_carts(tmp_path / "logs"))
    found = {e.port: e for e in answer.effects}
    assert answer.verdict == "effect" and len(answer.effects) == CARTS
    assert {e.family for e in answer.effects} == {"coulomb_friction"}
    numbers = [values_of(found[f"rail{k}"])[0] for k in range(1, CARTS + 1)]
    assert numbers == pytest.approx(FRICTIONS.tolist(), rel=0.05)


FRICTION, LAG = 1.2, 0.02


def rates(x: Array, u: Array) -> list[float]:
    """Of position, speed and filtered acceleration of a cart with dry friction."""
    a = (u - 2.0 * x[1] - FRICTION * np.tanh(x[1] / 1e-3)) / 2.0
    return [x[1], a, (a - x[2]) / LAG]


def run(seed: int) -> pd.DataFrame:
    random, t = np.random.default_rng(seed), 0.005 * np.arange(600)
    u = sum(4.0 * np.sin(rate * t + phase) for rate, phase in random.uniform((2, 0), (12, 6), (3, 2)))
    path = motion(rates, [0.0, 0.0, u[0] / 2.0], u, 0.005, substeps=10, held=True)
    columns = path[:, [0, 2]] + random.normal(0.0, (1e-5, 0.02), (len(t), 2))
    return pd.DataFrame({"t": t, "F": u, "x": columns[:, 0], "acc": columns[:, 1]})


@pytest.mark.long
def test_friction_behind_a_filtered_accelerometer(tmp_path: Path) -> None:
    logs = write_runs(tmp_path / "logs", [run(seed) for seed in range(6)])
    system = text_of("cart_with_accelerometer.yaml", ("F: {unit: N}", "F: {unit: N, hold: true}"))
    answer = diagnosed(tmp_path, system, logs)
    found = {(e.family, e.port): values_of(e) for e in answer.effects}
    assert found[("coulomb_friction", "rail")][0] == pytest.approx(FRICTION, rel=0.05)
    # over these windows, a filter of four samples is told as a delay
    assert found[("sensor_delay", "sensor:acc")][0] == pytest.approx(LAG, rel=0.2)
    again = unmodelled.read_logs(logs, answer.system)
    assert unmodelled.simulate(answer.system, again).value < 0.05
