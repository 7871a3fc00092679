"""A law that is missing at all ports of one kind is found there at once, with numbers of its own at each."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis.studies import effect
from tests.machines.folders import Array, diagnosed, motion, recorded, system_of, text_of, values_of
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.effects.place import Place
from unmodelled.logs.folder import read_logs
from unmodelled.logs.preparation import prepared_for

#: Carts in a row with springs between them, whose file knows no friction; dry friction, N.
FILE = text_of("carts.yaml")
CARTS, STIFFNESS, MASS = 6, 60.0, 2.0
FRICTION = np.array([1.5, 0.8, 2.2, 1.1, 1.8, 0.6])
PERIOD, SAMPLES, RUNS = 0.01, 500, 8


def _record(folder: Path) -> Path:
    """Sums of sines drive the carts; smooth sign of the speed."""
    t = PERIOD * np.arange(SAMPLES)
    stiff = STIFFNESS * (2.0 * np.eye(CARTS) - np.eye(CARTS, k=1) - np.eye(CARTS, k=-1))

    def rates(x: Array, u: Array) -> list[Array]:
        return [x[1], (u - stiff @ x[0] - FRICTION * np.tanh(x[1] / 0.01)) / MASS]

    def run(rng: np.random.Generator) -> pd.DataFrame:
        size, speed = 5.0 * rng.normal(size=(CARTS, 4)), rng.uniform(1.0, 8.0, (CARTS, 4, 1))
        u = np.einsum("cs,cst->tc", size, np.sin(speed * t + rng.uniform(0.0, 6.3, (CARTS, 4, 1))))
        x = motion(rates, np.zeros((2, CARTS)), u, PERIOD)[:, 0]
        noisy = x + 2e-4 * rng.standard_normal((SAMPLES, CARTS))
        names = [f"{name}{k + 1}" for name in "xu" for k in range(CARTS)]
        return pd.DataFrame(np.column_stack([t, noisy, u]), columns=["t", *names])

    return recorded(folder, run, RUNS, 3)


@pytest.fixture(scope="module")
def carts(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder = tmp_path_factory.mktemp("carts")
    system = system_of(FILE, folder)
    return Study.of(system, prepared_for(system, read_logs(_record(folder / "logs"), system)), 0.5, 0)


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
    answer = diagnosed(tmp_path, FILE, _record(tmp_path / "logs"))
    found = {e.port: e for e in answer.effects}
    assert answer.verdict == "effect" and len(answer.effects) == CARTS
    assert {e.family for e in answer.effects} == {"coulomb_friction"}
    numbers = [values_of(found[f"rail{k}"])[0] for k in range(1, CARTS + 1)]
    assert numbers == pytest.approx(FRICTION.tolist(), rel=0.05)
