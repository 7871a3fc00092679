"""The virtual bench obeys mechanics, and its logs have the form and the mix of labels of measured ones."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.rigs.cam_follower import TURN, CamFollowerRig
from pipeline.rigs.campaign import CHANNELS, factorial, write_campaign
from unmodelled.base.errors import BadInput

pytestmark = pytest.mark.long

HEIGHTS, SKEWS = (0.01, 0.03, 0.05, 0.07), tuple(np.pi * np.array([0.5, 0.75, 1.0, 1.25, 1.5]))
MASSES, VOLTAGES = (0.7325, 0.9379, 1.1238, 1.3067), tuple(np.linspace(3.6, 10.8, 20))
PI = float(np.pi)
RIG = CamFollowerRig()
#: Nothing drives and nothing dissipates.
NOTHING = ("torque_constant", "gear_friction", "gear_friction_drop", "ripple", "merge_velocity")
NOTHING += ("guide_coulomb", "guide_viscous", "guide_side")
IDLE = replace(RIG, **dict.fromkeys(NOTHING, 0.0), restitution=1.0, patience=10.0, stop_angle=100 * TURN)


def label(log: dict[str, np.ndarray], H: float) -> tuple[str, float]:
    """Label of a run, and the per-turn maximum of eps as a fraction of the threshold of a jump."""
    theta = np.unwrap(log["theta"])
    theta -= TURN if theta[0] > np.pi else 0.0
    if theta[-1] < 1.5 * TURN:
        return "stall", 0.0
    turn = np.floor(theta / TURN).astype(int)
    level = float(np.mean([log["eps"][turn == k].max() for k in range(1, turn.max())])) / (0.013 * H)
    return ("jump" if level > 1.0 else "contact"), level


@pytest.mark.parametrize(("speed", "bounces"), [(8.0, False), (25.0, True)])
def test_energy_is_conserved_without_drive_and_friction(speed: float, bounces: bool) -> None:
    run = IDLE.simulate(0.03, 1.25 * PI, 0.9379, 0.0, omega=speed, duration=1.0)
    assert len(run["t"]) > 1900
    assert bool(np.any(run["contact"] == 0.0)) is bounces
    np.testing.assert_allclose(run["energy"], run["energy"][0], rtol=1e-4)


def test_inelastic_impacts_lose_energy_and_nothing_gains_any() -> None:
    run = replace(IDLE, restitution=0.3).simulate(0.05, PI, 0.7325, 0.0, omega=25.0, duration=1.0)
    loss = np.diff(run["energy"])
    assert loss.min() < -0.01
    assert loss.max() < 1e-6


@pytest.mark.parametrize("H", HEIGHTS)
@pytest.mark.parametrize("beta", SKEWS)
def test_phases_keep_their_unilateral_conditions(H: float, beta: float) -> None:
    for V in (4.7, 7.4, 10.8):
        run = RIG.simulate(H, beta, 0.7325, V)
        contact = run["contact"] == 1.0
        assert np.min(run["y"] - run["h"]) > -1e-6
        assert np.min(run["force"][contact]) >= 0.0
        assert np.all(run["y"][contact] == run["h"][contact])
        assert np.all(run["force"][~contact] == 0.0)


@pytest.mark.parametrize("V", [5.0, 10.8])
def test_shorter_steps_change_nothing(V: float) -> None:
    coarse = RIG.simulate(0.03, PI, 0.9379, V, duration=1.0)
    fine = replace(RIG, period=RIG.period / 4).simulate(0.03, PI, 0.9379, V, duration=1.0)
    n = min(len(coarse["t"]), len(fine["t"]) // 4)
    for name, tolerance in (("theta", 1e-6), ("omega", 1e-4), ("y", 1e-7)):
        np.testing.assert_allclose(coarse[name][:n], fine[name][::4][:n], atol=tolerance, rtol=0.0)


def test_follower_at_rest_carries_its_weight() -> None:
    locked = replace(RIG, inertia=1e9)
    run = locked.simulate(0.05, PI, 1.1238, 0.0, theta=0.5 * PI, duration=0.2)
    np.testing.assert_allclose(run["force"], 1.1238 * 9.81, rtol=1e-9)


def test_terminal_speed_on_a_flat_cam() -> None:
    rig = replace(RIG, ripple=0.0, gear_friction_drop=0.0, stop_angle=1e6)
    run = rig.simulate(0.0, PI, 1.0, 8.0, duration=2.0)
    torque = rig.torque_constant * 8.0 / rig.resistance - rig.gear_friction
    assert run["omega"][-1] == pytest.approx(torque * rig.resistance / rig.torque_constant**2, rel=1e-6)
    assert run["current"][-1] == pytest.approx(rig.gear_friction / rig.torque_constant, rel=1e-6)


def test_lift_off_starts_where_the_contact_force_vanishes() -> None:
    run = RIG.simulate(0.03, 1.25 * PI, 0.7325, 10.8)
    first = int(np.argmin(run["contact"]))
    assert first > 100
    assert run["force"][first - 1] < 0.1 * 0.7325 * 9.81
    assert run["y"][first] - run["h"][first] < 1e-6


@pytest.mark.parametrize(
    ("H", "beta", "m", "V", "expected"),
    [
        (0.07, 0.5 * PI, 1.3067, 3.6, "stall"),
        (0.07, 0.5 * PI, 0.7325, 10.8, "jump"),
        (0.07, 1.5 * PI, 0.7325, 9.0, "jump"),
        (0.01, PI, 1.3067, 3.6, "contact"),
        (0.01, PI, 1.3067, 6.0, "contact"),
    ],
)
def test_known_corners_of_the_factorial(H: float, beta: float, m: float, V: float, expected: str) -> None:
    assert label(RIG.run(H, beta, m, V, 3), H)[0] == expected


def test_log_has_the_form_of_a_measured_one() -> None:
    H = 0.03
    log = RIG.run(H, PI, 0.9379, 6.0, 5)
    assert tuple(log) == CHANNELS
    assert len({len(values) for values in log.values()}) == 1
    assert log["t"][0] == 0.0
    assert np.diff(log["t"]) == pytest.approx(5e-4, abs=1e-5)
    assert np.all((log["theta"] >= 0.0) & (log["theta"] < TURN))
    theta = np.unwrap(log["theta"])
    counts = theta / RIG.encoder_count
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    np.testing.assert_allclose(np.gradient(theta, log["t"])[100:-100], log["omega"][100:-100], atol=1.0)
    np.testing.assert_array_equal(log["eps"], log["y"] - log["h"])
    assert 1e-6 < np.std(log["eps"]) < 3e-4


def test_a_log_depends_on_seed_and_factors_alone() -> None:
    one, same, other = (RIG.run(0.01, PI, 0.9379, 9.0, seed) for seed in (1, 1, 2))
    for name in CHANNELS:
        np.testing.assert_array_equal(one[name], same[name])
    assert one["theta"][0] != other["theta"][0]


def test_labels_of_a_subset_are_mixed_and_clear() -> None:
    table = factorial(HEIGHTS, SKEWS, MASSES[::3], VOLTAGES[2::5])
    results = [label(RIG.run(r.H, r.beta, r.m, r.V, 0), r.H) for r in table.itertuples()]
    labels, level = np.array([name for name, _ in results]), np.array([value for _, value in results])
    assert len(labels) == 160
    assert np.mean(labels == "jump") >= 0.1
    assert np.mean(labels == "contact") >= 0.2
    assert np.mean(labels == "stall") <= 0.15
    assert np.quantile(level[labels == "contact"], 0.95) < 0.6
    assert np.quantile(level[labels == "jump"], 0.1) > 2.0


def test_factorial_order_is_that_of_the_published_table() -> None:
    table = factorial(HEIGHTS, SKEWS, MASSES, VOLTAGES)
    assert list(table.columns) == ["exp", "H", "beta", "m", "V"]
    assert table["exp"].tolist() == list(range(1, 1601))
    assert table.loc[20].tolist() == [21, 0.01, 0.5 * PI, 0.9379, 3.6]
    assert table.loc[400, "H"] == 0.03


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, pd.DataFrame]:
    path = tmp_path_factory.mktemp("campaign") / "raw.zip"
    table = factorial((0.01,), (PI,), (1.3067,), (8.0, 9.0, 10.8))
    calls: list[tuple[int, int]] = []
    write_campaign(path, table, RIG, 4, workers=1, progress=lambda done, total: calls.append((done, total)))
    assert calls == [(1, 3), (2, 3), (3, 3)]
    return path, table


def test_campaign_is_readable(campaign: tuple[Path, pd.DataFrame]) -> None:
    path, table = campaign
    assert [entry.name for entry in path.parent.iterdir()] == ["raw.zip"]
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        with archive.open("Dataset/parameters.csv") as stream:
            pd.testing.assert_frame_equal(pd.read_csv(stream), table)
        text = archive.read("Dataset/experiments/exp2.csv").decode()
    rows = [np.array(line.split(","), dtype=float) for line in text.splitlines()]
    assert len(rows) == 7
    assert len({len(row) for row in rows}) == 1
    for name, row in zip(CHANNELS, rows, strict=True):
        np.testing.assert_allclose(row, RIG.run(0.01, PI, 1.3067, 9.0, 4)[name], rtol=1e-4)


def test_equal_campaigns_are_equal_bytes(campaign: tuple[Path, pd.DataFrame], tmp_path: Path) -> None:
    path, table = campaign
    write_campaign(tmp_path / "again.zip", table, RIG, 4, workers=2)
    assert (tmp_path / "again.zip").read_bytes() == path.read_bytes()
    write_campaign(tmp_path / "part.zip", table.iloc[1:2], RIG, 4, workers=1)
    with zipfile.ZipFile(path) as whole, zipfile.ZipFile(tmp_path / "part.zip") as part:
        name = "Dataset/experiments/exp2.csv"
        assert part.read(name) == whole.read(name)


def test_a_failed_campaign_leaves_nothing(campaign: tuple[Path, pd.DataFrame], tmp_path: Path) -> None:
    def fail(done: int, total: int) -> None:
        raise OSError("disk full")

    with pytest.raises(BadInput):
        write_campaign(tmp_path / "raw.zip", campaign[1], RIG, 4, workers=1, progress=fail)
    assert list(tmp_path.iterdir()) == []
