"""A push that the log does not hold is told with its time and size; what belongs to the machine is none."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.benches import PERIOD, Bench, exact, pendulum
from tests.diagnosis.studies import HORIZON, judged
from unmodelled.diagnosis.data.result import LogFault
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.outside_forces import outside_forces
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System

STILL = Bench(friction=0.0, noise=5e-5, runs=8)


def found(
    folder: Path, bench: Bench, push: float = 0.0, runs: tuple[int, ...] = (2,), loaded: tuple[int, ...] = ()
) -> LogFault | None:
    """What is said of the true pendulum without friction if runs are pushed from 0.4 to 0.6 s, N m."""
    system = pendulum(folder)
    logs, known = bench.logs(folder / "logs", system), exact(system)
    load = [run in loaded for run in range(len(logs))]
    logs = replace(logs, experiments=logs.experiments.assign(load=np.array(load, float)))
    pushed = (logs.t >= 0.4) & (logs.t < 0.6) & np.isin(logs.owner, runs)
    logs = prepare(known, replace(logs, u=logs.u - push * pushed[:, None]))
    return told(known, logs)


def told(known: System, logs: Logs) -> LogFault | None:
    return outside_forces(Corrections.of(judged("true", known, logs), HORIZON, Sensors(logs)))


@pytest.mark.parametrize("push", [0.3, -0.6])
def test_a_push_is_told_with_time_and_size(tmp_path: Path, push: float) -> None:
    fault = found(tmp_path, STILL, push)
    assert fault is not None and not fault.decides
    assert (fault.channels, fault.problem, fault.experiments) == (("joint",), "outside_force", ("run2",))
    # an effort takes power out of the system, a push in the direction of the motion puts it in
    amount, start, end = (float(fault.sentence.split()[k]) for k in (2, 8, 10))
    assert amount == pytest.approx(-push, rel=0.15)
    assert [start, end] == pytest.approx([0.4, 0.6], abs=0.03)
    assert fault.explains == pytest.approx(1.0, abs=0.15)


def test_two_of_eight_runs_are_pushed(tmp_path: Path) -> None:
    fault = found(tmp_path, STILL, 0.5, (1, 6))
    assert fault is not None and fault.experiments == ("run1", "run6")
    assert "needs so much. It looks like an outside force" in fault.sentence


@pytest.mark.parametrize(
    ("loaded", "told"), [((1, 6), "These are the experiments in which load is 1"), ((1, 5, 6), "It looks")]
)
def test_what_all_pushed_runs_and_no_others_share_is_told(
    tmp_path: Path, loaded: tuple[int, ...], told: str
) -> None:
    fault = found(tmp_path, STILL, 0.5, (1, 6), loaded)
    assert fault is not None and f"none needs so much. {told}" in fault.sentence


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("bench", [STILL, replace(STILL, friction=0.06), replace(STILL, dead_zone=0.1)])
def test_what_belongs_to_the_machine_is_no_outside_force(tmp_path: Path, bench: Bench, seed: int) -> None:
    assert found(tmp_path, replace(bench, seed=seed)) is None


def test_a_run_that_differs_throughout_was_not_pushed(tmp_path: Path) -> None:
    supply = (1.0,) * 7 + (1.5,)
    assert found(tmp_path, replace(STILL, supply=supply)) is None


def test_a_fault_of_a_few_samples_is_no_outside_force(tmp_path: Path) -> None:
    system = pendulum(tmp_path)
    logs, known = STILL.logs(tmp_path / "logs", system), exact(system)
    spike = logs.y.copy()
    spike[logs.rows(3)][200:202] += 0.05
    logs = prepare(known, replace(logs, y=spike))
    assert PERIOD * 8 < HORIZON
    assert told(known, logs) is None
