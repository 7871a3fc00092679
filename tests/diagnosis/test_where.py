"""Where the gap lies: what was planted at a place is found there, and a push that the log does not hold."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.rigs.withheld.campaign import write
from pipeline.rigs.withheld.cases import Case
from tests.diagnosis.benches import PERIOD, Bench, exact, pendulum
from tests.diagnosis.diagnoses import BENCH, friction, told
from tests.diagnosis.studies import HORIZON, judged
from tests.machines.folders import Array, read_case
from unmodelled.diagnosis.answer.figure_tables import write_tables
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel, LogFault
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.faults.outside_forces import outside_forces
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.effect_channels import channel_of, channel_shares
from unmodelled.diagnosis.where.where import Where, factors, where
from unmodelled.effects.place import Place
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.report.figures import experiments, residual
from unmodelled.systems.model import System


@dataclass(frozen=True)
class Creeping(Bench):
    """Friction that is there at low speeds only, below about `width` rad/s."""

    width: float = 0.6

    def rates(self, x: Array, u: Array) -> Array:
        found = super().rates(x, u)
        found[1] -= 0.1 * np.tanh(x[1] / 0.02) * np.exp(-((x[1] / self.width) ** 4)) / 0.02
        return found


@pytest.fixture(scope="module")
def named(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    return friction(tmp_path_factory.mktemp("named"))


@pytest.fixture(scope="module")
def unknown(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Bench], Where]:
    """Where the gap of a bench lies if no effect is known that explains it."""
    return lambda bench: where(friction(tmp_path_factory.mktemp("unknown"), bench, "unknown"))


def true_model(folder: Path, bench: Bench) -> JudgedModel:
    """The pendulum without friction, all else as it is."""
    system, logs = bench.recorded(folder)
    known = exact(system)
    return judged("true", known, prepare(known, logs))


def top(found: Where) -> str:
    return str(found.channels[0]["port"])


@pytest.mark.parametrize("noise", [2e-5, 2e-4, 1e-3])
def test_windows_recover_the_effort_within_its_standard_error(tmp_path: Path, noise: float) -> None:
    bench = replace(BENCH, noise=noise)
    model = true_model(tmp_path, bench)
    found = Corrections.of(model, HORIZON, Sensors(model.logs))
    recording = found.recording
    speed = [model.logs.x[a : a + n + 1, 1] for a, n in zip(recording.start, recording.steps, strict=True)]
    planted = np.array([np.mean(0.06 * np.tanh(v / bench.creep)) for v in speed])
    off = (found.value[:, 0] - planted) / found.error[:, 0]
    assert 0.7 < np.sqrt(np.mean(off**2)) < 1.4
    assert np.median(found.error[:, 0]) < 0.02
    # a torque that the drive lacks cannot be told from one that the joint takes, window by window
    np.testing.assert_allclose(found.value[:, 1], -found.value[:, 0], rtol=1e-4, atol=1e-6)
    # the noisier the sensor, the longer the windows
    assert recording.steps.max() == {2e-5: 8, 2e-4: 16, 1e-3: 32}[noise]


@pytest.mark.long
def test_a_named_effect_has_its_share(named: Diagnosis) -> None:
    found = where(named)
    assert top(found) == "joint" and found.channels[0]["share"] > 0.95
    assert sum(row["share"] for row in found.channels) == pytest.approx(1.0, abs=0.02)
    # with the right parameters dry friction is the same at all speeds but the lowest
    assert all(row["signal"] != "theta" for row in found.regions)
    joint = found.left.value[:, 0] / found.left.error[:, 0]
    assert np.sqrt(np.mean(joint**2)) < 1.5


@pytest.mark.long
@pytest.mark.parametrize(
    ("bench", "expected"),
    [
        *((BENCH, "joint"), (replace(BENCH, friction=0.0, ripple=0.05), "joint")),
        (replace(BENCH, friction=0.0, dead_zone=0.15), "actuator:torque"),
    ],
)
def test_unexplained_gaps_lie_where_the_fault_is(
    unknown: Callable[[Bench], Where], bench: Bench, expected: str
) -> None:
    found = unknown(bench)
    assert top(found) == expected and found.channels[0]["share"] > 0.7
    assert sum(row["share"] for row in found.channels) == pytest.approx(1.0, abs=0.02)


@pytest.mark.long
def test_regions_are_where_the_effort_is(unknown: Callable[[Bench], Where]) -> None:
    found = unknown(Creeping(runs=6, samples=600, friction=0.0))
    speed = [row for row in found.regions if row["signal"] == "omega"]
    assert len(speed) == 1
    assert -1.6 < speed[0]["low"] < 0.0 < speed[0]["high"] < 1.6 and speed[0]["share"] > 0.7
    assert len(found.regions) <= 6
    sizes = [row["share"] for row in found.regions]
    assert sizes == sorted(sizes, reverse=True)


@pytest.mark.long
def test_without_a_gap_it_lies_nowhere(tmp_path: Path) -> None:
    found = where(friction(tmp_path, replace(BENCH, friction=0.0), "no_gap"))
    assert found.channels == found.regions == found.factors == ()
    assert len(found.experiments) == BENCH.runs


@pytest.mark.parametrize("without", ["parameters", "ports", "inputs", "position", "coordinates", "delay"])
def test_systems_that_lack_something(tmp_path: Path, without: str) -> None:
    ports = "ports:\n  joint: {effort: tau, unit: N m, position: theta, velocity: omega}\n"
    changes = {
        "parameters": [
            (", identify: true, bounds: [0, 0.1]", ""),
            (", identify: true, bounds: [0.2, 5]", ""),
        ],
        "ports": [(ports, ""), (" - tau", "")],
        "inputs": [("inputs:\n  torque: {unit: N m}\n", ""), ("torque - b", "-b")],
        "position": [("position: theta, ", "")],
        "coordinates": [(", position: theta, velocity: omega", "")],
        "delay": [("outputs:\n  theta: {unit: rad}", "outputs:\n  theta: {unit: rad, delay: 0.004}")],
    }
    Bench(runs=4, samples=60).logs(tmp_path / "logs", pendulum(tmp_path))
    system = pendulum(tmp_path / "changed", *changes[without])
    diagnosis = replace(told(system, read_logs(tmp_path / "logs", system)), verdict="unknown")
    found = where(diagnosis)
    assert sum(row["share"] for row in found.channels) == pytest.approx(1.0, abs=0.02)
    assert {row["port"] for row in found.channels} <= {"joint", "actuator:torque", "sensor:theta"}
    write_tables(diagnosis, found, tmp_path / "out")
    for draw in (residual.lacking, experiments.gaps_of_experiments):
        draw(tmp_path / "out")


def test_a_channel_has_the_fall_of_the_step_of_its_effect() -> None:
    """The larger effect was found last."""
    models = [SimpleNamespace(gap=SimpleNamespace(value=value)) for value in (1.0, 0.9, 0.0)]
    places = {"joint": (Place("port", "joint"), 1), "sensor:theta": (Place("sensor", "theta"), 0)}
    effects = [SimpleNamespace(added=SimpleNamespace(place=place), step=k) for place, k in places.values()]
    ends = {"reidentified": models[0], "augmented": models[-1]}
    found: Any = SimpleNamespace(floor=0.0, verdict="effect", effects=effects, steps=models, **ends)
    assert channel_shares(found, {}) == pytest.approx({"joint": 0.81, "sensor:theta": 0.19})


def test_levels_with_more_than_their_share() -> None:
    table = pd.DataFrame({"group": list("AABBABAABB"), "m": 5 * [1.0, 2.0], "same": 1.0, "own": range(10)})
    size = np.random.default_rng(0).uniform(0.8, 1.2, 10)
    excess = np.where(table["group"] == "B", 1.0, 0.1) * size
    columns = ("group", "m", "same", "own", "absent")
    found = factors(table, columns, excess, np.full(10, 500.0), 0)
    assert [(row["factor"], row["level"]) for row in found] == [("group", "B")]
    assert found[0]["share"] == pytest.approx(excess[table["group"] == "B"].sum() / excess.sum())
    assert factors(table, columns, size, np.full(10, 500.0), 0) == ()
    assert factors(table, columns, -size, np.full(10, 500.0), 0) == ()


def test_parameters_act_through_channels(tmp_path: Path) -> None:
    case = Case("hoist", (), 1.0, 3)
    write(case, tmp_path, replace(case.plan(), samples=300))
    system, logs = read_case(tmp_path)
    model = judged("known", system, logs)
    names = {name: channel_of(model, Place("parameter", name)) for name in ("kf", "b", "M")}
    assert names == {"kf": "actuator:u", "b": "rail", "M": "rail"}
    assert channel_of(model, Place("sensor", "x")) == "sensor:x"


STILL = Bench(friction=0.0, noise=5e-5, runs=8)


def pushed(
    folder: Path,
    bench: Bench,
    push: float = 0.0,
    runs: tuple[int, ...] = (2,),
    loaded: tuple[int, ...] = (),
    alarm: bool = True,
) -> LogFault | None:
    """What is said of the true pendulum without friction if runs are pushed from 0.4 to 0.6 s, N m."""
    system = pendulum(folder)
    logs, known = bench.logs(folder / "logs", system), exact(system)
    load = [run in loaded for run in range(len(logs))]
    logs = replace(logs, experiments=logs.experiments.assign(load=np.array(load, float)))
    during = (logs.t >= 0.4) & (logs.t < 0.6) & np.isin(logs.owner, runs)
    logs = prepare(known, replace(logs, u=logs.u - push * during[:, None]))
    return push_of(known, logs, alarm)


def push_of(known: System, logs: Logs, alarm: bool = True) -> LogFault | None:
    return outside_forces(Corrections.of(judged("true", known, logs), HORIZON, Sensors(logs)), alarm)


@pytest.mark.parametrize("push", [0.3, -0.6])
def test_a_push_is_told_with_time_and_size(tmp_path: Path, push: float) -> None:
    fault = pushed(tmp_path, STILL, push)
    assert fault is not None and not fault.decides
    assert (fault.channels, fault.problem, fault.experiments) == (("joint",), "outside_force", ("run2",))
    # an effort takes power out of the system, a push in the direction of the motion puts it in
    numbers = re.findall(r"(?<= )-?\d[\d.]*(?=\s)", fault.sentence)
    amount, start, end = map(float, numbers[:3])
    assert amount == pytest.approx(-push, rel=0.15)
    assert [start, end] == pytest.approx([0.4, 0.6], abs=0.03)
    assert fault.explains == pytest.approx(1.0, abs=0.15)


def test_two_of_eight_runs_are_pushed(tmp_path: Path) -> None:
    fault = pushed(tmp_path, STILL, 0.5, (1, 6))
    assert fault is not None and fault.experiments == ("run1", "run6")
    assert "needs so much. It looks like an outside force" in fault.sentence


def test_beside_a_right_model_a_push_is_a_remark_without_advice(tmp_path: Path) -> None:
    fault = pushed(tmp_path, STILL, 0.5, (1, 6), (1, 6), alarm=False)
    assert fault is not None and fault.sentence.startswith("run1 needs ")
    assert fault.sentence.endswith(" s, more than other experiments need, and too little to make a gap")
    assert "outside force" not in fault.sentence and "diagnose again" not in fault.sentence


@pytest.mark.parametrize(
    ("loaded", "told"), [((1, 6), "These are the experiments in which load is 1"), ((1, 5, 6), "It looks")]
)
def test_what_all_pushed_runs_and_no_others_share_is_told(
    tmp_path: Path, loaded: tuple[int, ...], told: str
) -> None:
    fault = pushed(tmp_path, STILL, 0.5, (1, 6), loaded)
    assert fault is not None and f"none needs so much. {told}" in fault.sentence


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(k, marks=pytest.mark.long) for k in (2, 3))])
@pytest.mark.parametrize("bench", [STILL, replace(STILL, friction=0.06), replace(STILL, dead_zone=0.1)])
def test_what_belongs_to_the_machine_is_no_outside_force(tmp_path: Path, bench: Bench, seed: int) -> None:
    assert pushed(tmp_path, replace(bench, seed=seed)) is None


def test_a_run_that_differs_throughout_was_not_pushed(tmp_path: Path) -> None:
    supply = (1.0,) * 7 + (1.5,)
    assert pushed(tmp_path, replace(STILL, supply=supply)) is None


def test_a_fault_of_a_few_samples_is_no_outside_force(tmp_path: Path) -> None:
    system = pendulum(tmp_path)
    logs, known = STILL.logs(tmp_path / "logs", system), exact(system)
    spike = logs.y.copy()
    spike[logs.rows(3)][200:202] += 0.05
    logs = prepare(known, replace(logs, y=spike))
    assert PERIOD * 8 < HORIZON
    assert push_of(known, logs) is None
