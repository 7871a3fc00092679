"""The virtual slider-crank bench obeys mechanics, and its campaign has the form of chapter 4's."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import cumulative_trapezoid

from pipeline.rigs.slider_crank import STARTS, SliderCrankCampaign, SliderCrankRig
from pipeline.rigs.slider_crank_profiles import PROFILES
from unmodelled.base.errors import BadInput

pytestmark = pytest.mark.long

COUNT = 2 * np.pi / 8192
RIG = SliderCrankRig()
SMOOTH = replace(RIG, coulomb=0.0, static=0.0, viscous=0.0, damping=0.0, ripple=0.0, ripple_share=0.0)
RUNS = [(number, start) for number in range(1, len(PROFILES) + 1) for start in STARTS.values()]


@cache
def simulated(number: int, start: float) -> dict[str, np.ndarray]:
    return RIG.simulate(PROFILES[number - 1], start)


def geometry(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """d (eq. 4.1) and its derivative with respect to theta."""
    phi = np.arcsin(0.05 / 0.29 * np.sin(theta))
    d = 0.05 * np.cos(theta) + 0.29 * np.cos(phi) - 0.24
    return d, -0.05 * np.sin(theta) - 0.05 * np.cos(theta) * np.tan(phi)


def effective_inertia(theta: float) -> float:
    """Twice the kinetic energy at one radian per second (J1, rod, slider)."""
    phi = np.arcsin(0.05 / 0.29 * np.sin(theta))
    rate = 0.05 * np.cos(theta) / (0.29 * np.cos(phi))
    centre = np.array([-0.05 * np.sin(theta) - 0.145 * np.sin(phi) * rate, 0.025 * np.cos(theta)])
    slider = geometry(np.array(theta))[1]
    return float(0.0034 + 0.35 * centre @ centre + 0.35 * 0.29**2 / 12 * rate**2 + 0.77 * slider**2)


@pytest.mark.parametrize(("number", "start"), RUNS)
def test_loop_stays_closed_and_the_slider_follows_the_crank(number: int, start: float) -> None:
    run = simulated(number, start)
    d, slope = geometry(run["theta"])
    assert np.max(run["gap"]) < 1e-5
    np.testing.assert_allclose(run["d"], d, atol=1e-5, rtol=0.0)
    np.testing.assert_allclose(run["v"], slope * run["omega"], atol=0.01, rtol=0.0)


def test_energy_is_conserved_without_drive_and_friction() -> None:
    run = SMOOTH.simulate(np.zeros_like, 0.3)
    assert np.ptp(run["theta"]) > 5.5
    kinetic = 0.5 * np.array([effective_inertia(theta) for theta in run["theta"]]) * run["omega"] ** 2
    assert kinetic.max() > 1.0
    np.testing.assert_allclose(run["energy"], run["energy"][0], atol=0.002 * kinetic.max(), rtol=0.0)


@pytest.mark.parametrize(("number", "start"), RUNS)
def test_energy_changes_by_the_work_of_drive_damping_and_friction(number: int, start: float) -> None:
    run = simulated(number, start)
    power = run["drive"] * run["omega"] - 0.007 * run["omega"] ** 2 - run["friction"] * run["v"]
    work = cumulative_trapezoid(power, run["t"], initial=0.0)
    gain = run["energy"] - run["energy"][0]
    np.testing.assert_allclose(gain, work, atol=0.01 * np.ptp(run["energy"]), rtol=0.0)


@pytest.mark.parametrize("theta", [0.3, 1.0, 1.6, 2.2, 3.5, 4.4, 5.5])
@pytest.mark.parametrize("torque", [-3.0, 2.0])
def test_acceleration_from_rest_is_that_of_lagrange(theta: float, torque: float) -> None:
    run = SMOOTH.simulate(lambda t: np.full_like(t, torque), theta, samples=5)
    d, slope = geometry(np.array(theta))
    weight = 9.81 * (0.23 * 0.025 + 0.35 * 0.025) * np.cos(theta)
    force = 1.0 + 60.0 * d + 55.0 * (d / 0.1) ** 4
    expected = (torque - weight - slope * force) / effective_inertia(theta)
    assert run["omega"][1] / 5e-4 == pytest.approx(expected, rel=0.01)


def test_friction_takes_power_out_and_the_spring_stiffens() -> None:
    speeds = np.concatenate([-np.geomspace(1e-5, 5.0, 60), np.geomspace(1e-5, 5.0, 60)])
    assert min(RIG.friction(v) * v for v in speeds) > 0.0
    assert RIG.friction(0.01) > RIG.friction(0.1) < RIG.friction(3.0)
    force = RIG.spring(np.linspace(0.0, 0.1, 60))
    assert force[0] >= 0.0
    assert np.all(np.diff(force) > 0.0)
    assert np.all(np.diff(force, 2) > 0.0)
    assert 60.0 <= force[-1] <= 100.0


def test_a_released_slider_is_pushed_to_the_shaft() -> None:
    run = RIG.simulate(np.zeros_like, 0.3, samples=100)
    assert np.all(np.diff(run["d"]) < 0.0)


def test_half_of_the_profiles_are_slow_and_every_half_covers_the_stroke() -> None:
    top = {key: float(np.max(np.abs(simulated(*key)["omega"]))) for key in RUNS}
    slow, fast = [[key for key in RUNS if (key[0] <= 5) is half] for half in (True, False)]
    assert len(slow) == len(fast) == 10
    assert 15.0 < min(top[key] for key in slow) < max(top[key] for key in slow) < 35.0
    assert 50.0 < min(top[key] for key in fast) < max(top[key] for key in fast) < 90.0
    for half, fastest in ((slow, 1.2), (fast, 2.8)):
        d, v = (np.concatenate([simulated(*key)[name] for key in half]) for name in ("d", "v"))
        cells, _, _ = np.histogram2d(d, v, bins=[np.linspace(0.0, 0.1, 6), np.linspace(-fastest, fastest, 7)])
        assert np.count_nonzero(cells) >= 24  # of 30: the corners cannot be reached, v vanishes at both ends


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench") / "logs"
    provenance = SliderCrankCampaign().write(folder, 3)
    assert provenance["data"] == "virtual"
    assert provenance["seed"] == 3
    return folder


def test_campaign_has_twenty_logs_of_a_servo_drive(campaign: Path) -> None:
    table = pd.read_csv(campaign / "experiments.csv")
    assert list(table.columns) == ["id", "file", "profile", "start"]
    assert table["id"].tolist() == [f"T{number}{mark}" for number in range(1, 11) for mark in "ab"]
    for row in table.itertuples():
        log = pd.read_csv(campaign / row.file)
        assert list(log.columns) == ["t", "theta", "omega", "T"]
        assert len(log) == 800
        assert log["t"][0] == 0.0
        np.testing.assert_allclose(np.diff(log["t"]), 5e-4, atol=1e-5, rtol=0.0)
        assert log["theta"].between(0.0, 2 * np.pi, inclusive="left").all()
        np.testing.assert_allclose(log["theta"] / COUNT, np.round(log["theta"] / COUNT), atol=1e-4, rtol=0.0)
        assert abs(log["theta"][0] - row.start) <= COUNT / 2 + 1e-8
        noise = log["T"] - PROFILES[row.profile - 1](log["t"].to_numpy())
        assert 0.008 < noise[5:].std() < 0.1


def test_what_judges_the_results_lies_beside_the_logs(campaign: Path) -> None:
    spring = pd.read_csv(campaign / "spring.csv")
    assert len(spring) == 60
    np.testing.assert_allclose(spring["F"], RIG.spring(spring["d"].to_numpy()), rtol=1e-7)
    assert json.loads((campaign / "bench.json").read_text())["slider_mass"] == 0.77


def test_without_the_spring_the_logs_differ(campaign: Path, tmp_path: Path) -> None:
    SliderCrankCampaign(spring=False).write(tmp_path / "logs", 3)
    assert np.all(pd.read_csv(tmp_path / "logs" / "spring.csv")["F"] == 0.0)
    for name in pd.read_csv(campaign / "experiments.csv")["file"]:
        loaded, bare = (pd.read_csv(folder / name) for folder in (campaign, tmp_path / "logs"))
        assert np.ptp(np.unwrap(loaded["theta"]) - np.unwrap(bare["theta"])) > 0.3
        np.testing.assert_array_equal(loaded["t"], bare["t"])


def test_same_seed_same_bytes_other_seed_other_noise(campaign: Path, tmp_path: Path) -> None:
    for name, seed in (("same", 3), ("other", 4)):
        SliderCrankCampaign(profiles=[2, 9]).write(tmp_path / name, seed)
    for file in ("T2a.csv", "T2b.csv", "T9a.csv", "T9b.csv", "spring.csv", "bench.json"):
        assert (tmp_path / "same" / file).read_bytes() == (campaign / file).read_bytes()
    one, other = (pd.read_csv(tmp_path / name / "T9a.csv") for name in ("same", "other"))
    assert np.std(one["T"] - other["T"]) > 0.005
    np.testing.assert_allclose(np.unwrap(one["theta"]), np.unwrap(other["theta"]), atol=2 * COUNT)


@pytest.mark.parametrize(
    "wrong", [{"profiles": [0]}, {"profiles": [3, 3]}, {"profiles": []}, {"samples": 49}, {"profiles": ["x"]}]
)
def test_a_campaign_that_cannot_be_run_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(BadInput, match=r"source\."):
        SliderCrankCampaign(**wrong)  # type: ignore[arg-type]
