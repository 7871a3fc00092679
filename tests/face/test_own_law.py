"""A law of a user from its file to the page and to the next experiment."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled as um
from tests.commands import python
from tests.diagnosis.benches import pendulum
from tests.machines.folders import motion, write_runs

J, B, MGL, BRAKE, PERIOD = 0.02, 0.015, 1.2, 0.08, 0.004
LAWS = """schema: laws/1
laws:
  eddy_brake:
    formula: c*v*(1 - cos(x))
    numbers:
      c: {unit: mN m s/rad, plausible: 20, low: 0}
"""


def logged(seed: int) -> pd.DataFrame:
    """A pendulum with a brake that no law of the library describes: it grips where the arm is up."""
    rng, t = np.random.default_rng(seed), PERIOD * np.arange(1500)
    tones = rng.uniform(0.5, 12.0, 4), rng.uniform(0.0, 6.3, 4)
    torque = 0.45 * np.sin(tones[0] * t[:, None] + tones[1]).sum(axis=1)

    def rates(x: np.ndarray, u: np.ndarray) -> list[np.ndarray]:
        brake = BRAKE * x[1] * (1.0 - np.cos(x[0]))
        return [x[1], (u - B * x[1] - MGL * np.sin(x[0]) - brake) / J]

    theta = motion(rates, [0.1, 0.0], torque, PERIOD)[:, 0] + 2e-4 * rng.normal(size=len(t))
    return pd.DataFrame({"t": t, "torque": torque, "theta": theta})


@pytest.fixture(scope="module")
def answer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("braked")
    pendulum(folder)
    (folder / "laws.yaml").write_text(LAWS)
    write_runs(folder / "logs", [logged(k) for k in range(8)])
    words = ["system=system.yaml", "logs=logs", "laws=laws.yaml", "out=answer", "-q"]
    ran = python("-m", "unmodelled", "diagnose", *words, cwd=folder)
    assert ran.returncode == 0, ran.stderr
    return folder / "answer"


@pytest.mark.long
def test_the_law_is_named_with_its_number(answer: Path) -> None:
    found = um.read_answer(answer)
    assert found.verdict == "effect"
    (effect,) = found.effects
    assert (effect.family, effect.port, effect.law) == ("eddy_brake", "joint", "c*omega*(1 - cos(theta))")
    number = json.loads((answer / "diagnosis.json").read_text())["effects"][0]["parameters"]["c"]
    assert number["value"] == pytest.approx(BRAKE, rel=0.05) and number["unit"] == "N m s"
    assert found.system.port("joint").law is not None
    page = (answer / "index.html").read_text()
    assert "eddy brake" in page and "mN m s/rad" in page


@pytest.mark.long
def test_the_answer_brings_its_laws_to_the_next_experiment(answer: Path, tmp_path: Path) -> None:
    content = json.loads((answer / "diagnosis.json").read_text())
    assert [law["name"] for law in content["laws"]] == ["eddy_brake"]
    (limits := tmp_path / "limits.yaml").write_text(
        "duration: 2\nperiod: 0.01\ninputs: {torque: {low: -1.5, high: 1.5, rate: 40}}\n"
        "travel: {theta: {low: -3.1, high: 3.1}}\n"
    )
    made = um.next_experiment(um.read_answer(answer), limits)
    assert len(made.table()) > 100


@pytest.mark.long
def test_every_law_of_the_user_has_its_error_or_a_reason() -> None:
    size = {"unit": "N m", "plausible": 0.1}
    laws = [
        um.Law("swing", "k*sin(2*x)", {"k": size}),
        um.Law("brake", "c*sign(v)", {"c": {**size, "low": 0}}),
    ]
    found = um.diagnose(*um.example(), quiet=True, laws=laws)
    rows = [row for row in found.content["comparison"] if row["effects"]]
    (brake,) = (row for row in rows if row["effects"][-1]["family"] == "brake")
    assert brake["errors"]["theta"]["value"] > 0.0 and 0.0 <= brake["probability"] <= 1.0
    assert any(note.startswith("your law swing was ") for note in found.notes)
