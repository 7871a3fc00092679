"""The benches of the tutorial measure what the text says, and know more than the models."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.cam_follower.static import efficiency
from pipeline.rigs.tutorial import MotorBench, TutorialCampaign
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

SYSTEM = Path(__file__).parents[2] / "systems" / "pendulum.yaml"
PLAIN = MotorBench(brushes=0.0, dry=0.0, warming=0.0, reaction=0.0, fan=0.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bench") / "tutorial"
    provenance = TutorialCampaign(runs=3, far_runs=2).write(out, 0)
    assert provenance["data"] == "virtual" and provenance["experiments"] == 5
    return out


def test_a_motor_without_the_rest_is_the_model_of_two_parameters() -> None:
    current = np.linspace(2.0, 22.0, 9)
    model = efficiency(current, PLAIN.voltage, PLAIN.resistance, PLAIN.viscous / PLAIN.constant**2)
    np.testing.assert_allclose(PLAIN.efficiency(current), model, rtol=1e-12)


@pytest.mark.parametrize("loss", ["brushes", "dry", "warming", "fan"])
def test_everything_else_costs_something(loss: str) -> None:
    current = np.array([5.0, 12.0])
    worse = replace(PLAIN, **{loss: getattr(MotorBench(), loss)})
    assert np.all(worse.efficiency(current) < PLAIN.efficiency(current))


def test_it_is_measured_at_200_volts_from_4_to_15_amperes(folder: Path) -> None:
    """Section 2.2."""
    samples = pd.concat([pd.read_csv(folder / f"{name}.csv") for name in ("training", "new")])
    assert json.loads((folder / "bench.json").read_text())["motor"]["voltage"] == 200.0
    assert samples["current"].min() == 4.0 and samples["current"].max() == 15.0
    true = MotorBench().efficiency(samples["current"].to_numpy(np.float64))
    noise = samples["efficiency"] - true
    assert noise.std() == pytest.approx(TutorialCampaign().noise, rel=0.2)
    truth = pd.read_csv(folder / "truth.csv")
    assert truth["current"].min() < 2.0 and truth["current"].max() > 20.0


def test_large_torques_leave_what_small_ones_explore(folder: Path) -> None:
    logs = read_logs(folder / "pendulum", read_system(SYSTEM))
    assert list(logs.experiments["group"]) == ["explored"] * 3 + ["unseen"] * 2
    largest = [np.abs(logs.y[logs.rows(i), 0]).max() for i in range(len(logs))]
    assert max(largest[3:]) > 2.0 * max(largest[:3])


def test_a_seed_decides(folder: Path, tmp_path: Path) -> None:
    for seed in (0, 1):
        TutorialCampaign(runs=3, far_runs=2).write(tmp_path / str(seed), seed)
    files = ["training.csv", "new.csv", "pendulum/unseen/run1.csv"]
    for file in files:
        first, same, other = (p / file for p in (folder, tmp_path / "0", tmp_path / "1"))
        assert first.read_bytes() == same.read_bytes() != other.read_bytes()
