"""Encoders off their axis, and motors with a torque once per turn, are told apart."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import diagnosed, motion, only_effect, recorded, text_of
from unmodelled.api.answer import Answer
from unmodelled.base.answers import check_content
from unmodelled.base.files import read_json
from unmodelled.diagnosis.answer.sentences import sentences

pytestmark = pytest.mark.long
DEGREE, RPM, PERIOD = np.pi / 180.0, np.pi / 30.0, 5e-3


def turntable(folder: Path, error: float, torque: float, waves: int = 1) -> Answer:
    """A turntable that turns several times, logged in degrees and rpm.

    The encoder errs by `error` (rad), and `torque` (N m) acts, both so many times per turn.
    """
    t = PERIOD * np.arange(500)

    def run(rng: np.random.Generator) -> pd.DataFrame:
        rate, phase = rng.uniform(0.7, 4.0, 3), rng.uniform(0.0, 6.28, 3)
        current = rng.uniform(1.0, 2.5) * np.sin(rate * t[:, None] + phase).sum(1)

        def rates(x: np.ndarray, i: np.ndarray) -> list[float]:
            return [x[1], (0.4 * i - torque * np.sin(waves * x[0] + 0.4)) / 0.05]

        angle, speed = motion(rates, [rng.uniform(-3.0, 3.0), rng.uniform(-8.0, 8.0)], current, PERIOD).T
        shown = angle + error * np.sin(waves * angle + 0.4)
        slope = speed * (1.0 + waves * error * np.cos(waves * angle + 0.4))
        noise = 1e-4 * rng.standard_normal(len(t)), 5e-3 * rng.standard_normal(len(t))
        return pd.DataFrame(
            {
                "t": t,
                "i": 1e3 * current,
                "angle": (shown + noise[0]) / DEGREE,
                "omega": (slope + noise[1]) / RPM,
            }
        )

    return diagnosed(folder, text_of("turntable.yaml"), recorded(folder / "logs", run, 5, 3))


def test_an_encoder_errs_twice_per_turn(tmp_path: Path) -> None:
    """The speed is the slope of the shown angle."""
    answer = turntable(tmp_path, 0.02, 0.0, 2)
    effect = only_effect(answer, "cyclic_error", "sensor:angle")
    assert effect.law == "(theta) + A_s*sin(n_y*(theta)) + A_c*cos(n_y*(theta))"
    assert effect.parameters["A_s"]["value"] == pytest.approx(0.02 * np.cos(0.4), rel=0.03)
    assert effect.parameters["A_c"]["value"] == pytest.approx(0.02 * np.sin(0.4), rel=0.03)
    assert effect.parameters["n_y"]["value"] == pytest.approx(2.0, abs=1e-3)
    answer.save(tmp_path / "answer")
    _compensates(tmp_path / "answer", tmp_path / "logs")


def _compensates(answer: Path, logs: Path) -> None:
    """The table of an answer removes an error of 20 mrad from all logs, and every door names it."""
    name = "compensation_angle.csv"
    shown, add, low, high = pd.read_csv(answer / name).to_numpy().T
    assert (shown == np.arange(360.0)).all() and (low < add).all() and (add < high).all()
    for log in sorted(logs.glob("run*.csv")):
        angle = pd.read_csv(log)["angle"].to_numpy()
        right = DEGREE * (angle + np.interp(angle, shown, add, period=360.0))
        left = DEGREE * angle - (right + 0.02 * np.sin(2.0 * right + 0.4))
        assert np.abs(left).max() < 0.001  # with 0.1 mrad of noise
    content = read_json(answer / "diagnosis.json")
    (effect,) = content["effects"]
    assert effect["compensation"] == name
    told = "cyclic error of 1.15 deg twice per turn, largest at 34 deg"
    assert effect["text"].replace("\xa0", " ") == told
    assert any(name in line for line in sentences(content))
    assert name in read_json(answer / ".made_by")["files"]
    page = (answer / "index.html").read_text()
    assert f'href="./{name}"' in page and f"C{told[1:]}" in page.replace("\xa0", " ")
    check_content(answer, content, "diagnosis")


def test_a_torque_once_per_turn_has_two_names(tmp_path: Path) -> None:
    effect = only_effect(turntable(tmp_path, 0.0, 0.05), "gravity_load", "gear")
    assert effect.parameters["W_s"]["value"] == pytest.approx(0.05 * np.cos(0.4), rel=0.03)
    assert any(other.startswith("torque ripple") for other in effect.indistinguishable)
