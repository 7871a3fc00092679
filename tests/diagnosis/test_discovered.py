"""Planted laws that the library lacks are written down; planted laws of the library are named as such."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import (
    Array,
    diagnosed,
    motion,
    only_effect,
    recorded,
    system_of,
    text_of,
    values_of,
)
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.search.discovered import discovered
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.logs.folder import read_logs
from unmodelled.logs.preparation import prepared_for

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
        (lambda x, v: 12.5 * x**2 * v, "c_1*x**2*v", (12.5,)),
    ],
    ids=["drag", "damping that grows with the position"],
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


def test_a_formula_that_is_a_law_of_the_library_is_this_law(tmp_path: Path) -> None:
    """A spring, which the library's own fit may have missed, begins with the number of the formula."""
    system = system_of(CART, tmp_path)
    logs = read_logs(record(tmp_path / "logs", lambda x, v: 25.0 * x), system)
    search = EffectSearch(Study.of(system, prepared_for(system, logs), 0.5, 0))
    found = {h.effects[-1].key[:2]: start for h, start in discovered(search.base, search.few)}
    # to first order: the mass follows
    assert found["linear_spring", ""]["k_rail"] == pytest.approx(25.0, rel=0.5)
    assert ("discovered_law", "x") not in found
