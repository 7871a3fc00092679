"""Planted laws of drives: limits, gains, friction that warms up, held inputs, play in a coupling."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled
from tests.machines.folders import Array, diagnosed, motion, only_effect, recorded, text_of, write_runs
from unmodelled.api.answer import Answer

pytestmark = pytest.mark.long
#: Torque of all runs at a current (A), a speed (rad/s) and a time (s), in N m.
Torque = Callable[[Array, Array, float], Array]

PERIOD, SAMPLES, RUNS, NOISE = 4e-3, 350, 4, (1e-4, 2e-3)
#: V, ohm and V s/rad of the voltage-driven motor: at rest 3.2 A, none at 14 rad/s. A, the limit of its drive.
SUPPLY, RESISTANCE, BACK_EMF, LARGEST = 24.0, 7.5, 24.0 / 14.0, 3.2


def limited_by_voltage(i: Array, w: Array, t: float) -> Array:
    most, least = (SUPPLY - BACK_EMF * w) / RESISTANCE, (-SUPPLY - BACK_EMF * w) / RESISTANCE
    acting = np.clip(i, np.maximum(least, -LARGEST), np.minimum(most, LARGEST))
    return 0.52 * acting - 0.052 * w


def limited_in_power(i: Array, w: Array, t: float) -> Array:
    """The drive gives 2.5 A up to 4 rad/s, and a constant power above."""
    most = 2.5 * 4.0 / np.maximum(np.abs(w), 4.0)
    return 0.52 * np.clip(i, -most, most) - 0.052 * w


def saturating_iron(i: Array, w: Array, t: float) -> Array:
    return 0.52 * i / (1.0 + 0.08 * np.abs(i)) - 0.052 * w


def propeller(i: Array, w: Array, t: float) -> Array:
    """Half of it in proportion to the current, at 3 A the other half to its square."""
    return 0.52 * (0.5 * i + 0.5 * i * np.abs(i) / 3.0) - 0.052 * w


def warming_up(i: Array, w: Array, t: float) -> Array:
    dry = 0.1 + 0.3 * np.exp(-t / 2.0)
    return 0.52 * i - 0.052 * w - dry * np.tanh(w / 0.05)


def loose_and_weak_backwards(i: Array, w: Array, t: float) -> Array:
    acting = i - np.clip(i, -0.4, 0.4)
    return 0.52 * np.where(acting < 0.0, 0.7 * acting, acting) - 0.052 * w


def driven(folder: Path, torque: Torque) -> Answer:
    rng, t = np.random.default_rng(5), PERIOD * np.arange(SAMPLES)
    rate, phase = rng.uniform(1.5, 12.0, (3, RUNS)), rng.uniform(0.0, 6.28, (3, RUNS))
    current = rng.uniform(1.0, 2.0, RUNS) * np.sin(rate * t[:, None, None] + phase).sum(1)

    def rates(x: Array, u: Array) -> list[Array]:
        return [x[1], torque(u[:RUNS], x[1], u[-1]) / 0.02]

    path = motion(rates, np.zeros((2, RUNS)), np.column_stack([current, t]), PERIOD)
    seen = path.transpose(2, 1, 0) + np.array(NOISE)[:, None] * rng.standard_normal((RUNS, 2, SAMPLES))
    tables = [{"t": t, "i": i, "phi": x, "w": v} for i, (x, v) in zip(current.T, seen, strict=True)]
    return diagnosed(folder, text_of("drive.yaml"), write_runs(folder / "logs", tables))


def test_the_limit_of_a_motor_falls_with_its_speed(tmp_path: Path) -> None:
    effect = only_effect(driven(tmp_path, limited_by_voltage), "actuator_saturation", "actuator:i")
    assert effect.parameters["u_0"]["value"] == pytest.approx(SUPPLY / RESISTANCE, rel=0.01)
    assert effect.parameters["v_0"]["value"] == pytest.approx(SUPPLY / BACK_EMF, rel=0.01)
    assert [effect.parameters[name]["unit"] for name in ("u_0", "v_0")] == ["A", "rad/s"]


def test_the_power_of_a_drive_is_limited(tmp_path: Path) -> None:
    effect = only_effect(driven(tmp_path, limited_in_power), "actuator_saturation", "actuator:i")
    assert effect.law == "clip(i, -u_0*v_b/max(abs(w), v_b), u_0*v_b/max(abs(w), v_b))"
    assert effect.parameters["u_0"]["value"] == pytest.approx(2.5, rel=0.01)
    assert effect.parameters["v_b"]["value"] == pytest.approx(4.0, rel=0.01)


def test_the_torque_constant_falls_with_the_current(tmp_path: Path) -> None:
    """A curve of the current with another gain is the same."""
    answer = driven(tmp_path, saturating_iron)
    effect = only_effect(answer, "actuator_curve", "actuator:i")
    assert effect.indistinguishable == ("actuator saturation (falling gain) at input i",)
    f, gain = effect.parameters["f"]["value"], answer.parameters.set_index("name").loc["k_m", "identified"]
    # at rest; its slope is between that at rest and that of the chord at the largest current, 5 A
    assert (1.0 - f) * gain == pytest.approx(0.52, rel=0.05)
    assert 0.08 / 1.4 - 0.01 < -f / (1.0 - f) / 5.0 < 0.08


def test_the_torque_rises_faster_than_the_current(tmp_path: Path) -> None:
    answer = driven(tmp_path, propeller)
    effect = only_effect(answer, "actuator_curve", "actuator:i")
    assert effect.law == "i + f*(i*abs(i)/u_r - i)"
    f, gain = effect.parameters["f"]["value"], answer.parameters.set_index("name").loc["k_m", "identified"]
    assert (1.0 - f) * gain == pytest.approx(0.26, rel=0.02)
    assert 0.5 < f < 0.8


def test_two_faults_of_one_drive_are_both_named(tmp_path: Path) -> None:
    """A free curve in the current holds both, and is no reason to name one alone."""
    answer = driven(tmp_path, loose_and_weak_backwards)
    found = {effect.family: effect.parameters for effect in answer.effects}
    assert found.keys() == {"actuator_dead_zone", "actuator_asymmetry"}
    assert found["actuator_dead_zone"]["u_d"]["value"] == pytest.approx(0.4, rel=0.05)


def test_dry_friction_falls_as_the_machine_warms_up(tmp_path: Path) -> None:
    answer = driven(tmp_path, warming_up)
    assert answer.verdict == "effect"
    friction, drift = answer.effects
    # a Stribeck part of next to nothing may stand beside the constant part
    assert friction.family in ("coulomb_friction", "stribeck_friction")
    assert (drift.family, drift.port) == ("drift", "shaft")
    assert friction.parameters["F_c"]["value"] == pytest.approx(0.4, rel=0.03)
    mean = 0.3 * (np.exp(-SAMPLES * PERIOD / 2.0) - 1.0) / (SAMPLES * PERIOD)
    assert drift.parameters["F_t"]["value"] == pytest.approx(mean, rel=0.1)


@pytest.mark.parametrize("held", [True, False], ids=["held", "straight"])
def test_the_course_of_an_input_is_chosen_and_nothing_stands_in_for_it(tmp_path: Path, held: bool) -> None:
    """A motor with dry friction whose current is as fast as a sample, held by a digital controller or not."""
    t = 2e-3 * np.arange(400)

    def rates(x: Array, u: Array) -> list[float]:
        torque = 0.05 * x[0] - 0.012 * np.tanh(x[1] / 0.5)
        return [(u - 1.1 * x[0] - 0.05 * x[1]) / 2e-3, torque / 1.5e-4]

    def run(rng: np.random.Generator) -> pd.DataFrame:
        square = np.sign(np.sin(2 * np.pi * rng.uniform(2.0, 5.0) * t))
        u = rng.uniform(4.0, 10.0) * np.sin(2 * np.pi * rng.uniform(0.5, 2.0) * t) + 3.0 * square
        i, w = motion(rates, [0.0, 0.0], u, 2e-3, held=held).T
        noisy = {"i": i + 0.01 * rng.normal(size=len(t)), "w": w + 0.1 * rng.normal(size=len(t))}
        return pd.DataFrame({"t": t, "u": u, **noisy})

    answer = diagnosed(tmp_path, text_of("motor.yaml"), recorded(tmp_path / "logs", run, 6, 4))
    effect = only_effect(answer, "coulomb_friction", "shaft")
    assert effect.parameters["F_c"]["value"] == pytest.approx(0.012, rel=0.03)
    assert any("inputs keep their values" in note for note in answer.notes) == held
    answer.save(tmp_path / "answer")
    written = unmodelled.read_system(tmp_path / "answer" / "augmented_system.yaml")
    assert written.inputs[0].hold == held


def test_the_firmware_limits_the_ramp_of_a_command_and_filters_it(tmp_path: Path) -> None:
    """All sensors show the lag: it is that of the drive, which begins at zero."""
    t = 1e-2 * np.arange(400)

    def rates(x: Array, command: Array) -> list[Array]:
        ramp = np.clip((command - x[2]) / 1e-3, -6.0, 6.0)
        return [x[1], (0.5 * x[3] - 0.05 * x[1]) / 0.02, ramp, (x[2] - x[3]) / 0.08]

    def run(rng: np.random.Generator) -> pd.DataFrame:
        command = np.repeat(rng.uniform(-2.0, 2.0, 10), 40)
        phi, w = motion(rates, np.zeros(4), command, 1e-2, substeps=20, held=True).T[:2]
        noisy = {"phi": phi + 1e-4 * rng.normal(size=len(t)), "w": w + 2e-3 * rng.normal(size=len(t))}
        return pd.DataFrame({"t": t, "i": command, **noisy})

    answer = diagnosed(tmp_path, text_of("drive.yaml"), recorded(tmp_path / "logs", run, 5, 4))
    (effect,) = answer.effects
    assert (effect.family, effect.port) == ("actuator_rate_limit", "actuator:i")
    # a part of the lag is told as delays of all that is logged
    assert effect.parameters["r_u"]["value"] == pytest.approx(6.0, rel=0.1)


#: rad and N m/rad; the file says 40 N m/rad.
HALF_PLAY, STIFFNESS = 0.005, 42.0


def test_play_in_the_spring_of_a_coupling(tmp_path: Path) -> None:
    """The spring is in the file, and the play is named with its width."""
    t = 2e-3 * np.arange(400)

    def rates(x: Array, torque: Array) -> list[float]:
        twist = x[0] - x[2]
        loaded = max(abs(twist) - HALF_PLAY, 0.0) * np.sign(twist)
        shaft = STIFFNESS * loaded + 0.1 * (x[1] - x[3])
        return [x[1], (torque - shaft) / 0.01, x[3], shaft / 0.03]

    def run(rng: np.random.Generator) -> pd.DataFrame:
        rate, phase, size = rng.uniform(4.0, 40.0, 3), rng.uniform(0.0, 6.28, 3), rng.uniform(0.3, 0.8)
        torque = size * np.sin(rate * t[:, None] + phase).sum(1)
        path = motion(rates, np.zeros(4), torque, 2e-3, substeps=8)
        q1, q2 = path.T[[0, 2]] + 2e-5 * rng.standard_normal((2, len(t)))
        return pd.DataFrame({"t": t, "u": torque, "q1": q1, "q2": q2})

    coupling = Path("systems/coupling.yaml").read_text()
    answer = diagnosed(tmp_path, coupling, recorded(tmp_path / "logs", run, 4, 3))
    effect = only_effect(answer, "backlash", "shaft")
    assert effect.law == "-k*(x_0 + clip(twist - x_0, -delta, delta))"
    width, centre = effect.parameters["delta"], effect.parameters["x_0"]
    assert width["interval"][0] <= HALF_PLAY <= width["interval"][1] < 1.01 * HALF_PLAY
    assert width["unit"] == "rad"
    assert centre["interval"][0] <= 0.0 <= centre["interval"][1]
    spring = answer.parameters.set_index("name").loc["k"]
    assert abs(spring["identified"] - STIFFNESS) < 0.01 * STIFFNESS
