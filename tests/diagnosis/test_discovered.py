"""Planted laws that the library lacks are written down; planted laws of the library are named as such."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import diagnosed, system_of, write_runs
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.search.discovered import DiscoveredLaw, discovered
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.logs.folder import read_logs
from unmodelled.logs.preparation import prepared_for

CART = """
schema: system/1
name: cart
states:
  x: {unit: m}
  v: {unit: m/s}
inputs:
  u: {unit: N, commanded: false}
outputs:
  x: {unit: m}
  v: {unit: m/s}
parameters:
  m: {value: 1.8, unit: kg, identify: true, bounds: [1, 4]}
  k: {value: 40, unit: N/m}
ports:
  rail: {effort: F, unit: N, position: x, velocity: v}
dynamics:
  x: v
  v: (u - k*x - F)/m
"""
PERIOD, SAMPLES, RUNS, STEPS = 0.01, 600, 8, 20
Force = Callable[[float, float], float]


def record(folder: Path, force: Force, seed: int = 1) -> Path:
    """Sums of sines drive a cart of 2 kg on a spring; midpoint rule with 20 steps a sample."""
    rng, tables, t = np.random.default_rng(seed), [], PERIOD * np.arange(SAMPLES)
    for _ in range(RUNS):
        size, rate, phase = 4.0 * rng.normal(size=5), rng.uniform(0.1, 1.5, 5), rng.uniform(0.0, 6.3, 5)
        u = np.sin(2.0 * np.pi * rate * t[:, None] + phase) @ size
        x, v, shown, h = 0.0, 0.0, [], PERIOD / STEPS
        for now, then in zip(u, np.append(u[1:], u[-1]), strict=True):
            shown.append((x, v))
            for step in range(STEPS):
                drive = now + (then - now) * (step + 0.5) / STEPS
                half = v + 0.5 * h * (drive - 40.0 * x - force(x, v)) / 2.0
                middle = x + 0.5 * h * v
                x, v = x + h * half, v + h * (drive - 40.0 * middle - force(middle, half)) / 2.0
        noisy = np.array(shown) + rng.standard_normal((SAMPLES, 2)) * [2e-4, 1e-3]
        tables.append(pd.DataFrame({"t": t, "u": u, "x": noisy[:, 0], "v": noisy[:, 1]}))
    return write_runs(folder, tables)


@pytest.mark.long
@pytest.mark.parametrize(
    ("force", "law", "numbers"),
    [
        (lambda x, v: 0.6 * v * abs(v) + 0.8 * v**3, "c_1*v*abs(v) + c_2*v**3", (0.6, 0.8)),
        (lambda x, v: 12.5 * x**2 * v, "c_1*x**2*v", (12.5,)),
    ],
    ids=["drag", "damping that grows with the position"],
)
def test_a_law_that_the_library_lacks_is_written_down(
    force: Force, law: str, numbers: tuple[float, ...], tmp_path: Path
) -> None:
    answer = diagnosed(tmp_path, CART, record(tmp_path / "logs", force))
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "discovered_law", "rail")
    assert effect.law == law
    found = [effect.parameters[f"c_{k}"]["value"] for k in range(1, len(numbers) + 1)]
    assert found == pytest.approx(numbers, rel=0.02)


@pytest.mark.long
def test_a_law_of_the_library_is_named_as_such(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, CART, record(tmp_path / "logs", lambda x, v: 2.0 * v * abs(v)))
    assert [e.family for e in answer.effects] == ["quadratic_drag"]


def test_a_formula_that_is_a_law_of_the_library_is_this_law(tmp_path: Path) -> None:
    """A spring, which the library's own fit may have missed, begins with the number of the formula."""
    system = system_of(CART, tmp_path)
    logs = read_logs(record(tmp_path / "logs", lambda x, v: 25.0 * x), system)
    search = EffectSearch(Study.of(system, prepared_for(system, logs), 0.5, 0))
    found = {h.effects[-1].key[:2]: start for h, start in discovered(search.base, search.few)}
    # to first order: the mass follows
    assert found["linear_spring", ""]["k_rail"] == pytest.approx(25.0, rel=0.5)
    assert ("discovered_law", "x") not in found


def test_a_law_is_known_by_its_variant() -> None:
    law = DiscoveredLaw.named("x**3 + v*abs(v)")
    assert (law.variant, law.complexity) == ("x**3 + v*abs(v)", 3.0)
    with pytest.raises(KeyError, match=r"x\*\*9"):
        DiscoveredLaw.named("x**9")
