"""Planted laws of carts: written down where the library lacks them, at every cart, and behind a filter."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled
from tests.diagnosis.studies import effect, fitted
from tests.machines.folders import (
    Array,
    diagnosed,
    logs_of,
    motion,
    only_effect,
    recorded,
    system_of,
    text_of,
    values_of,
    write_runs,
)
from unmodelled.diagnosis.core.choose import Chooser
from unmodelled.diagnosis.core.columns import Columns
from unmodelled.diagnosis.core.equations import Equations
from unmodelled.diagnosis.core.path import Path as FreeRun
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.diagnosis.search.discovered import discovered
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.effects.place import Place
from unmodelled.logs.folder import read_logs
from unmodelled.logs.preparation import prepared_for, several

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


@pytest.fixture(scope="module")
def carts(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder = tmp_path_factory.mktemp("carts")
    system = system_of(FILE, folder)
    return Study.of(system, prepared_for(system, read_logs(record_carts(folder / "logs"), system)), 0.5, 0)


def test_a_law_at_many_ports_of_one_kind_counts_once(carts: Study) -> None:
    law, grown = effect("coulomb_friction"), [Hypothesis.known(carts)]
    for k in range(1, CARTS + 1):
        grown.append(grown[-1].plus(law, Place("port", f"rail{k}")))
    assert [len(one.together) for one in grown] == [0, 1, 2, 1, 1, 1, 1]
    other = grown[-1].plus(effect("viscous_friction"), Place("port", "rail1"))
    assert [len(group) for group in other.together] == [CARTS, 1]


def test_lags_of_all_sensors_of_one_unit_are_one_filter(carts: Study) -> None:
    lagged = wrong = Hypothesis.known(carts)
    for k in (1, 2, 3):
        lagged = lagged.plus(effect("sensor_lag"), Place("sensor", f"x{k}"))
        wrong = wrong.plus(effect("sensor_gain"), Place("sensor", f"x{k}"))
    assert [len(unit) for unit in lagged.units] == [len(group) for group in lagged.together] == [3]
    assert [len(unit) for unit in wrong.units] == [len(group) for group in wrong.together] == [1, 1, 1]
    rubbing = lagged
    for k in (1, 2, 3):
        rubbing = rubbing.plus(effect("coulomb_friction"), Place("port", f"rail{k}"))
    assert [len(group) for group in rubbing.together] == [3, 3]
    assert [len(unit) for unit in rubbing.units] == [3, 1, 1, 1]


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


def test_an_accelerometer_alone_has_a_linear_system(tmp_path: Path) -> None:
    """No output shows a state: no start is measured, and hidden states start with the experiments."""
    runs = [run(seed)[["t", "F", "acc"]] for seed in range(4)]
    known = system_of(text_of("cart_with_accelerometer.yaml", ("  x: {unit: m}\n", "")), tmp_path)
    logs = several(known, logs_of(known, tmp_path / "logs", runs))
    base = fitted(Hypothesis.known(Study.of(known, logs, 0.3, 0)))
    columns = Columns(FreeRun.of(base, base.recording))
    assert columns.starts.shape[3] == 0 and len(columns.own.prior) == 2
    chooser = Chooser(Equations.of(columns), columns.path.gap)
    assert ("sensor_lag", "sensor:acc") in [next(iter(s.names))[:2] for s in chooser.singles[:5]]


@pytest.mark.long
def test_friction_behind_a_filtered_accelerometer(tmp_path: Path) -> None:
    logs = write_runs(tmp_path / "logs", [run(seed) for seed in range(6)])
    system = text_of("cart_with_accelerometer.yaml", ("F: {unit: N}", "F: {unit: N, hold: true}"))
    answer = diagnosed(tmp_path, system, logs)
    found = {(e.family, e.port): values_of(e) for e in answer.effects}
    assert found[("coulomb_friction", "rail")][0] == pytest.approx(FRICTION, rel=0.05)
    assert found[("sensor_lag", "sensor:acc")][0] == pytest.approx(LAG, rel=0.05)
    again = unmodelled.read_logs(logs, answer.system)
    assert unmodelled.simulate(answer.system, again).value < 0.05
