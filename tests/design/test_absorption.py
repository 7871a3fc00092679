"""What networks in ports absorb, and what the efforts there are, on a pendulum where the answer is known."""

from pathlib import Path

import numpy as np
import pytest

from tests.design.motions import RATES, acceleration_of, motion, read
from tests.machines.folders import text_of
from unmodelled.design.absorption import beside_networks
from unmodelled.design.advice import advise
from unmodelled.design.identifiability import COLLINEAR, identify_sets
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

PENDULUM = text_of("weighted_pendulum.yaml")


def pendulum(folder: Path, rates: tuple[float, ...], text: str = PENDULUM) -> tuple[System, Logs]:
    """Runs whose load tau = 0.3 omega the model leaves out."""
    logs = []
    for start in (0.2, 1.1):
        t, x, v, a = motion(rates, start)
        torque = 0.5 * a + 2.0 * np.sin(x) + 0.3 * v
        logs.append({"t": t, "theta": x, "omega": v, "torque": torque})
    return read(folder, text, logs)


def test_a_network_absorbs_gravity_but_not_inertia(tmp_path: Path) -> None:
    system, logs = pendulum(tmp_path, RATES)
    result = identify_sets(system, logs)
    assert result.absorbed == ("weight",)
    assert result.unabsorbed["J"] > 0.2
    assert [s.names for s in result.sets if s.with_network] == [("J",)]
    sentences = advise(system, result)
    assert any(s.startswith("weight is absorbed by the network in port joint") for s in sentences)
    assert any(s.startswith("{J, weight}, marked in the system file, cannot") for s in sentences)


def test_a_network_absorbs_inertia_where_the_motion_says_it_all(tmp_path: Path) -> None:
    """One sine: the acceleration is a function of the position."""
    result = identify_sets(*pendulum(tmp_path, (3.1,)))
    assert result.absorbed == ("J", "weight")
    assert not any(s.with_network for s in result.sets)
    assert result.judge(("J",)).collinearity_with_network == COLLINEAR


def test_the_effort_is_what_the_logs_need(tmp_path: Path) -> None:
    system, logs = pendulum(tmp_path, RATES)
    load = 0.3 * np.sqrt(np.mean(logs.x[:, 1] ** 2))
    expected = load / 0.5 / acceleration_of(RATES)
    assert identify_sets(system, logs).norms["tau"] == pytest.approx(expected, rel=0.02)


def test_an_effort_that_enters_nonlinearly_is_found_too(tmp_path: Path) -> None:
    text = PENDULUM.replace("- tau)/J", "- (tau + tau**3))/J").replace("unit: N m,", "unit: '',")
    text = text.replace(", velocity: omega}", "}")
    for unit in ("rad/s", "rad", "N m", "kg m^2"):
        text = text.replace(f"unit: {unit}", "unit: ''")
    system, logs = pendulum(tmp_path, RATES, text)
    load = 0.3 * logs.x[:, 1]
    tau = np.array([np.real(r[np.abs(r.imag) < 1e-9][0]) for r in (np.roots([1, 0, 1, -f]) for f in load)])
    expected = np.sqrt(np.mean(((1.0 + 3.0 * tau**2) / 0.5) ** 2) * np.mean(tau**2))
    found = identify_sets(system, logs).norms["tau"]
    assert found == pytest.approx(expected / acceleration_of(RATES), rel=0.03)


def test_two_ports_with_the_same_effect_are_no_fault_of_the_parameters(tmp_path: Path) -> None:
    text = PENDULUM.replace("dynamics:", "  second: {effort: mu, unit: N m, position: theta}\ndynamics:")
    result = identify_sets(*pendulum(tmp_path, RATES, text.replace("- tau)", "- tau - mu)")))
    assert result.correlation_of("tau", "mu") == pytest.approx(1.0)
    assert result.judge(("J",)).both


def test_samples_without_a_value_are_left_out(tmp_path: Path) -> None:
    text = PENDULUM.replace("weight*sin(theta)", "weight*sqrt(theta + 0.5)")
    result = identify_sets(*pendulum(tmp_path, RATES, text))
    assert any("samples at which a derivative has no value were left out" in n for n in result.found.notes)
    assert np.isfinite(result.found.matrix).all()


@pytest.mark.parametrize("inputs", [1, 2, 4])
def test_networks_take_functions_of_their_inputs_and_leave_noise(inputs: int) -> None:
    generator = np.random.default_rng(0)
    q, gain = generator.uniform(-1.0, 1.0, (2000, inputs)), generator.uniform(0.5, 2.0, 2000)
    q = np.hstack([q, np.ones((2000, 1))])  # an input that never moves says nothing
    known, noise = gain * np.sin(2.0 * q).sum(1), generator.standard_normal(2000)
    left = beside_networks(np.stack([known, noise, known + noise], -1), [gain], [q])
    assert np.mean(left[:, 0] ** 2) < 0.01 * np.mean(known**2)
    assert np.mean(left[:, 1] ** 2) == pytest.approx(np.mean(noise**2), rel=0.05)
    assert left[:, 2] == pytest.approx(left[:, 0] + left[:, 1], abs=1e-6)
