"""A law that is missing at all ports of one kind is found there at once, with numbers of its own at each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from tests.diagnosis.studies import effect
from tests.machines.folders import diagnosed, system_of, write_runs
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.effects.place import Place
from unmodelled.logs.folder import read_logs
from unmodelled.logs.preparation import prepared_for

Array = NDArray[np.float64]

#: Carts in a row with springs between them; dry friction, N.
CARTS, STIFFNESS, MASS = 6, 60.0, 2.0
FRICTION = np.array([1.5, 0.8, 2.2, 1.1, 1.8, 0.6])
PERIOD, SAMPLES, RUNS, STEPS = 0.01, 500, 8, 10


def _text() -> str:
    """System file of the carts, which knows no friction."""
    each = range(1, CARTS + 1)
    spring = [
        f"{STIFFNESS}*(2*x{k} - {f'x{k - 1}' if k > 1 else 0} - {f'x{k + 1}' if k < CARTS else 0})"
        for k in each
    ]
    lines = [
        *("schema: system/1", "name: carts", "states:"),
        *(f"  x{k}: {{unit: m}}\n  v{k}: {{unit: m/s}}" for k in each),
        *("inputs:", *(f"  u{k}: {{unit: N, commanded: false}}" for k in each)),
        *("outputs:", *(f"  x{k}: {{unit: m}}" for k in each)),
        *("parameters:", f"  k: {{value: {STIFFNESS}, unit: N/m}}"),
        "  m: {value: 1.7, unit: kg, identify: true, bounds: [1, 4]}",
        *("ports:", *(f"  rail{k}: {{effort: F{k}, unit: N, position: x{k}, velocity: v{k}}}" for k in each)),
        "dynamics:",
        *(
            f"  x{k}: v{k}\n  v{k}: (u{k} - {spring[k - 1].replace(str(STIFFNESS), 'k')} - F{k})/m"
            for k in each
        ),
    ]
    return "\n".join(lines) + "\n"


def _record(folder: Path) -> Path:
    """Sums of sines drive the carts; midpoint rule with ten steps a sample, smooth sign of the speed."""
    rng, tables, t = np.random.default_rng(3), [], PERIOD * np.arange(SAMPLES)
    stiff = STIFFNESS * (2.0 * np.eye(CARTS) - np.eye(CARTS, k=1) - np.eye(CARTS, k=-1))

    def rate(x: Array, v: Array, u: Array) -> Array:
        return (u - stiff @ x - FRICTION * np.tanh(v / 0.01)) / MASS

    for _ in range(RUNS):
        size, speed = 5.0 * rng.normal(size=(CARTS, 4)), rng.uniform(1.0, 8.0, (CARTS, 4, 1))
        u = np.einsum("cs,cst->tc", size, np.sin(speed * t + rng.uniform(0.0, 6.3, (CARTS, 4, 1))))
        x, v, shown, h = np.zeros(CARTS), np.zeros(CARTS), [], PERIOD / STEPS
        for now, then in zip(u, [*u[1:], u[-1]], strict=True):
            shown.append(x)
            for step in range(STEPS):
                drive = now + (then - now) * (step + 0.5) / STEPS
                half = v + 0.5 * h * rate(x, v, drive)
                x, v = x + h * half, v + h * rate(x + 0.5 * h * v, half, drive)
        noisy = np.array(shown) + 2e-4 * rng.standard_normal((SAMPLES, CARTS))
        columns = {f"x{k + 1}": noisy[:, k] for k in range(CARTS)} | {
            f"u{k + 1}": u[:, k] for k in range(CARTS)
        }
        tables.append(pd.DataFrame({"t": t, **columns}))
    return write_runs(folder, tables)


@pytest.fixture(scope="module")
def carts(tmp_path_factory: pytest.TempPathFactory) -> Study:
    folder = tmp_path_factory.mktemp("carts")
    system = system_of(_text(), folder)
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
    answer = diagnosed(tmp_path, _text(), _record(tmp_path / "logs"))
    found = {e.port: e for e in answer.effects}
    assert answer.verdict == "effect" and len(answer.effects) == CARTS
    assert {e.family for e in answer.effects} == {"coulomb_friction"}
    numbers = [next(iter(found[f"rail{k}"].parameters.values()))["value"] for k in range(1, CARTS + 1)]
    assert numbers == pytest.approx(FRICTION.tolist(), rel=0.05)
