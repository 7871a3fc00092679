"""Efforts that act between two ports, in a system file that has no port there."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis.studies import HORIZON
from tests.machines.folders import Array, diagnosed, motion, only_effect, recorded, system_of, text_of
from unmodelled.api.diagnosis import diagnose
from unmodelled.api.next_experiment import next_experiment
from unmodelled.effects.ports_between import comparable_ports, with_ports_between
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System, symbol
from unmodelled.systems.reader import read_system
from unmodelled.systems.writer import write_system

Effort = Callable[[Array], tuple[float, float]]

PERIOD, SAMPLES, RUNS, NOISE = 2e-3, 500, 4, 1e-5


def damping_between(x: Array) -> tuple[float, float]:
    torque = 0.12 * (x[1] - x[3])
    return torque, -torque


def friction_of_the_load(x: Array) -> tuple[float, float]:
    return 0.0, 0.08 * float(np.tanh(x[3] / 0.05))


def friction_beside_damping(x: Array) -> tuple[float, float]:
    torque = 0.06 * (x[1] - x[3])
    return torque, 0.25 * float(np.tanh(x[3] / 0.05)) - torque


def rates(x: Array, torque: Array, effort: Effort) -> Array:
    one, two = effort(x)
    spring = 45.0 * (x[0] - x[2])
    return np.array([x[1], (torque - spring - one) / 0.01, x[3], (spring - two) / 0.03])


def logged(folder: Path, effort: Effort) -> tuple[System, Logs]:
    t = PERIOD * np.arange(SAMPLES)

    def run(rng: np.random.Generator) -> pd.DataFrame:
        u = 0.5 * np.sin(rng.uniform(4.0, 60.0, 3) * t[:, None] + rng.uniform(0.0, 6.28, 3)).sum(1)
        x = motion(lambda x, u: rates(x, u, effort), np.zeros(4), u, PERIOD)
        seen = x[:, [0, 2]] + NOISE * rng.standard_normal((SAMPLES, 2))
        return pd.DataFrame({"t": t, "u": u, "q1": seen[:, 0], "q2": seen[:, 1]})

    known = system_of(text_of("two_masses.yaml"), folder)
    return known, prepare(known, read_logs(recorded(folder / "logs", run, RUNS, 1), known))


def test_a_port_between_two_masses_takes_from_one_what_it_gives_to_the_other(tmp_path: Path) -> None:
    known = system_of(text_of("two_masses.yaml"), tmp_path)
    (pair,) = comparable_ports(known)
    grown, (name,) = with_ports_between(known, (pair,))
    between = grown.port(name)
    assert ([port.name for port in pair], name) == (["motor", "load"], "motor_load")
    assert (between.effort, between.unit) == ("T1_T2", "N m")
    one, other = (grown.dynamics[k].diff(symbol("T1_T2")) for k in (1, 3))
    assert (one, other) == (-1 / symbol("J1"), 1 / symbol("J2"))
    assert grown.signals["q1_minus_q2"] == symbol("q1") - symbol("q2")
    # what is written to a file comes back
    write_system(grown, tmp_path / "grown.yaml")
    assert read_system(tmp_path / "grown.yaml").dynamics == grown.dynamics


@pytest.mark.long
def test_a_law_between_two_masses_is_named_without_a_port_in_the_file(tmp_path: Path) -> None:
    answer = diagnose(*logged(tmp_path, damping_between), HORIZON)
    (effect,) = answer.effects
    assert (effect.family, effect.port) == ("viscous_friction", "motor_load")
    (note,) = (n for n in answer.notes if "the system file has no port motor_load" in n)
    assert "acts between two ports" in note
    (number,) = effect.parameters.values()
    assert number["value"] == pytest.approx(0.12, rel=0.03)
    # the file of the machine has no such port; the experiment to make next is designed with it
    (tmp_path / "limits.yaml").write_text("duration: 0.5\ninputs: {u: {low: -1, high: 1}}\n")
    assert next_experiment(answer, tmp_path / "limits.yaml").table()["u"].abs().max() <= 1.0


@pytest.mark.long
def test_a_law_between_two_masses_is_named_beside_a_larger_one(tmp_path: Path) -> None:
    answer = diagnose(*logged(tmp_path, friction_beside_damping), HORIZON)
    named = {(e.family, e.port): next(iter(e.parameters.values()))["value"] for e in answer.effects}
    assert named == {
        ("coulomb_friction", "load"): pytest.approx(0.25, rel=0.01),
        ("viscous_friction", "motor_load"): pytest.approx(0.06, rel=0.01),
    }


@pytest.mark.long
def test_heat_between_two_rooms_is_named_without_a_port_in_the_file(tmp_path: Path) -> None:
    """Two balances with heat exchange of 0.02 W/K; heaters are held."""

    def rates(T: Array, heat: Array) -> Array:
        exchange = 0.02 * (T[0] - T[1])
        return (heat - 0.05 * (T - 293.0) - np.array([exchange, -exchange])) / 2.0

    def run(rng: np.random.Generator) -> pd.DataFrame:
        Q = rng.uniform(0.0, 1.0, (10, 2)).repeat(40, axis=0)
        T = motion(rates, 293.0 + rng.uniform(0.0, 5.0, 2), Q, 1.0, held=True)
        seen = T + 0.02 * rng.standard_normal(T.shape)
        columns = np.column_stack([np.arange(float(len(Q))), Q, seen])
        return pd.DataFrame(columns, columns=["t", "Q1", "Q2", "T1", "T2"])

    logs = recorded(tmp_path / "logs", run, 6, 2)
    effect = only_effect(diagnosed(tmp_path, text_of("rooms.yaml"), logs), "linear_loss", "left_right")
    number = effect.parameters["k"]
    assert number["value"] == pytest.approx(0.02, rel=0.03) and number["unit"] == "W/K"
