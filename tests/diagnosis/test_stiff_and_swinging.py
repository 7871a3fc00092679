"""Planted effects in small machines that are stiff or swing, or whose file has a wrong number."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import expm

import unmodelled as um
from tests.machines.folders import Array, diagnosed, motion, recorded, system_of, text_of

pytestmark = pytest.mark.long
Random = np.random.Generator


def steps(levels: list[float], hold: int, t: Array, rng: Random) -> Array:
    """A signal that takes a random level every `hold` samples."""
    return np.repeat(rng.choice(levels, len(t) // hold + 2), hold)[: len(t)]


def hot_coil(rng: Random) -> pd.DataFrame:
    """A current without inertia through copper that warms up within 40 s."""
    t = np.arange(0.0, 400.0, 0.5)
    u = steps([0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0], 60, t, rng)
    current = lambda u, warmer: u / (4.0 * (1.0 + 0.0039 * warmer))  # noqa: E731
    rates = lambda x, u: (u * current(u, x) - 0.35 * x) / 14.0  # noqa: E731
    i = current(u, motion(rates, [0.0], u, 0.5, held=True)[:, 0]) + 0.003 * rng.standard_normal(len(t))
    return pd.DataFrame({"t": t, "U": u + 0.005 * rng.standard_normal(len(t)), "i": np.round(i, 3)})


def dead_valve(rng: Random) -> pd.DataFrame:
    """A cylinder in a position loop, whose valve does nothing below 0.35 V."""
    t = np.arange(0.0, 20.0, 0.01)
    goal, gain = steps([0.1, 0.2, 0.3, 0.4], 170, t, rng), rng.normal(0.08, 0.003)
    x, u, here, v = np.zeros(len(t)), np.zeros(len(t)), 0.2, 0.0
    for k, aim in enumerate(goal):
        x[k], u[k] = here, np.clip(12.0 * (aim - here), -3.0, 3.0)
        for _ in range(5):
            v += 0.002 * (gain * np.sign(u[k]) * max(abs(u[k]) - 0.35, 0.0) - v) / 0.06
            here += 0.002 * v
    seen = np.round((x + 2e-5 * rng.standard_normal(len(t))) / 1e-4) * 1e-4
    return pd.DataFrame({"t": t, "u": u, "x": seen})


def rubbing_load(rng: Random) -> pd.DataFrame:
    """Two masses that swing against each other at 33 Hz, the second one with dry friction."""
    t = np.arange(0.0, 5.0, 0.002)
    torque = steps([-1.5, -0.8, -0.3, 0.0, 0.3, 0.8, 1.5], 125, t, rng)

    def rates(x: Array, torque: Array) -> list[Array]:
        s = 60.0 * (x[0] - x[2]) + 0.02 * (x[1] - x[3])
        rub = 0.2 * np.tanh(x[3] / 0.05) + 0.005 * x[3]
        return [x[1], (torque - s - 0.01 * x[1]) / 0.002, x[3], (s - rub) / 0.006]

    x, count = motion(rates, np.zeros(4), torque, 0.002, held=True).T, 2.0 * np.pi / 10_000
    seen = np.floor(x / count) * count
    noisy = torque + 0.01 * rng.standard_normal(len(t))
    return pd.DataFrame({"t": t, "M": noisy, "a": seen[0], "b": seen[2]})


def test_heat_of_a_coil_whose_inductance_is_given_ten_times_too_large(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, text_of("hot_coil.yaml"), recorded(tmp_path / "logs", hot_coil, 6))
    (effect,) = answer.effects
    assert (effect.family, effect.port) == ("self_heating", "winding")
    assert effect.parameters["tau_h"]["value"] == pytest.approx(14.0 / 0.35, rel=0.3)
    gap = answer.gaps.set_index("model")["gap"]
    assert gap["augmented"] < 0.2 * gap["reidentified"]


@pytest.mark.xfail(strict=True, reason="the valve is read straight between samples: decision 18, left")
def test_a_dead_zone_is_not_called_dry_friction(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, text_of("cylinder.yaml"), recorded(tmp_path / "logs", dead_valve, 7))
    assert (answer.effects[0].family, answer.effects[0].port) == ("actuator_dead_zone", "actuator:u")


def test_the_spring_between_two_masses_is_not_driven_to_its_bound(tmp_path: Path) -> None:
    logs = recorded(tmp_path / "logs", rubbing_load, 8)
    answer = diagnosed(tmp_path, text_of("damped_two_masses.yaml"), logs)
    assert (answer.effects[0].family, answer.effects[0].port) == ("coulomb_friction", "load")
    assert answer.parameters.set_index("name").loc["k", "identified"] == pytest.approx(60.0, rel=0.05)


WINCH = """
schema: system/1
name: winch
states: {w: {unit: rad/s}, i: {unit: A}, q: {unit: rad}}
inputs: {U: {unit: V, hold: true}}
outputs: {w: {unit: rad/s}, i: {unit: A}}
parameters:
  J: {value: 0.05, unit: kg m^2, identify: true, bounds: [0.01, 0.2]}
  b: {value: 0.03, unit: N m s/rad, identify: true, bounds: [0, 0.3]}
  k: {value: 0.62, unit: N m/A}
  R: {value: 1.5, unit: ohm}
  L: {value: 0.015, unit: H}
ports: {drum: {effort: T, unit: N m, position: q, velocity: w}}
dynamics: {w: (k*i - b*w - T)/J, i: (U - R*i - k*w)/L, q: w}
"""


def winch(rng: Random) -> pd.DataFrame:
    """A drum whose winding (10 ms) is as quick as the recorder, sampled exactly."""
    t, J, b, k, R, L = np.arange(0.0, 4.0, 0.016), 0.05, 0.03, 0.5, 1.5, 0.015
    U = steps([-24.0, -12.0, -6.0, 0.0, 6.0, 12.0, 24.0], 12, t, rng)
    rates = np.array([[-b / J, k / J, 0.0], [-k / L, -R / L, 1.0 / L], [0.0, 0.0, 0.0]])
    step, x = expm(0.016 * rates), np.zeros((len(t), 2))
    for n in range(len(t) - 1):
        x[n + 1] = (step @ [*x[n], U[n]])[:2]
    noisy = x + rng.normal(0.0, [0.01, 0.004], x.shape)
    return pd.DataFrame({"t": t, "U": U, "w": noisy[:, 0], "i": noisy[:, 1]})


@pytest.mark.xfail(strict=True, reason="a further law stands in for the chain's lag: decision 18, left")
def test_the_integration_is_refined_with_the_error_of_a_model_that_fits(tmp_path: Path) -> None:
    """Two steps per sample are enough beside the error of the file, and too coarse for the right number."""
    system = system_of(WINCH, tmp_path / "system")
    answer = um.diagnose(system, recorded(tmp_path / "logs", winch, 6), 0.4)
    (effect,) = answer.effects
    assert (answer.verdict, effect.family, effect.port) == ("effect", "parameter_error", "parameter:k")
    assert answer.parameters.set_index("name").loc["J", "identified"] == pytest.approx(0.05, rel=5e-4)


def fan(folder: Path, damping: float, drag: float = 0.0) -> str:
    """A fan of 0.05 kg m^2 and 0.2 N m s/rad, whose file may have another damping."""

    def rates(w: Array, T: Array) -> Array:
        return (T - 0.2 * w - 0.01 * np.tanh(w / 0.01) - drag * w * abs(w)) / 0.05

    def run(rng: np.random.Generator) -> pd.DataFrame:
        T = np.repeat(rng.uniform(-3.0, 3.0, 15), 20)
        w = motion(rates, [0.0], T, 0.01, held=True)[:, 0] + 0.01 * rng.standard_normal(len(T))
        return pd.DataFrame({"t": 0.01 * np.arange(len(T)), "T": T, "w": w})

    recorded(folder / "logs", run, 4, 3)
    return text_of("damped_fan.yaml", ("c: {value: 0.2", f"c: {{value: {damping}"))


def axis(folder: Path, stiffness: float, damping: float) -> str:
    """A carriage of 2 kg behind a servo of 800 N/m and 30 N s/m, whose file may have other numbers."""

    def run(rng: np.random.Generator) -> pd.DataFrame:
        goal, x, v, seen = np.repeat(rng.uniform(-0.1, 0.1, 12), 25), 0.0, 0.0, []
        for wanted in goal:
            seen.append(x)
            for _ in range(20):
                v += 5e-4 * (800.0 * (wanted - x) - 30.0 * v) / 2.0
                x += 5e-4 * v
        noisy = np.array(seen) + 2e-5 * rng.standard_normal(len(goal))
        return pd.DataFrame({"t": 0.01 * np.arange(len(goal)), "goal": goal, "x": noisy})

    recorded(folder / "logs", run, 4, 4)
    (folder / "robots").mkdir()
    numbers = ('kp="800"', f'kp="{stiffness}"'), ('damping="30"', f'damping="{damping}"')
    (folder / "robots" / "axis.xml").write_text(text_of("axis.xml", *numbers))
    return text_of("axis.yaml")


@pytest.mark.parametrize(
    ("machine", "numbers", "name", "right"),
    [
        *((fan, (0.2 * np.pi / 30.0,), "c", 0.2), (fan, (0.2 * 9.80665,), "c", 0.2)),
        *((axis, (0.8, 30.0), "servo_kp", 800.0), (axis, (800.0, 1800.0), "x_damping", 30.0)),
        (axis, (800.0, 42.0), "x_damping", 30.0),
        *((fan, (0.2,), "", 0.0), (fan, (0.2, 0.03), "", 0.0)),
    ],
    ids=["1/min", "kgf", "mN", "minutes", "high", "right", "drag"],
)
def test_a_wrong_number_of_the_file_is_named(
    machine: object, numbers: tuple[float, ...], name: str, right: float, tmp_path: Path
) -> None:
    assert callable(machine)
    (tmp_path / "system.yaml").write_text(machine(tmp_path, *numbers))
    answer = um.diagnose(tmp_path / "system.yaml", tmp_path / "logs", workers=1)
    told = [(e["family"], e.get("parameter")) for e in answer.content["effects"]]
    alike = {other for e in answer.effects for other in e.indistinguishable}
    if not name:
        assert all(family != "parameter_error" for family, _ in told)
        return
    # a damping that is too small is as much a friction that is missing
    found = {p.name: p.value for p in answer.system.parameters}
    if told == [("parameter_error", name)]:
        assert found[name] == pytest.approx(right, rel=0.02) and f"{name}_error" not in found
    else:
        assert f"parameter error of {name}" in alike
    if name == "servo_kp":  # the robot file gets the right number
        (change,) = answer.content["robot"]["changes"]
        assert (change["element"], change["quantity"], change["given"]) == ("servo", "kp", 0.8)
        assert change["patched"] == pytest.approx(800.0, rel=0.02)
        assert answer.content["robot"]["missing"] == []
