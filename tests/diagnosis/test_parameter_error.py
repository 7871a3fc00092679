"""A number of the file that is wrong is named, and the files that leave have the right one."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled as um
from tests.machines.folders import Array, motion, recorded, text_of


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


@pytest.mark.long
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
