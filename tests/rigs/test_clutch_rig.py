"""The virtual wet-clutch bench obeys mechanics and shifts when the known model does."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp

from pipeline.rigs.clutch import BOX, PERIOD, ClutchCampaign
from unmodelled.base.errors import BadInput
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.reader import read_system

pytestmark = pytest.mark.long

SYSTEMS = Path(__file__).parents[2] / "systems"
CASES = [7, 40, 73, 102]  # rows with all levels of u1, and with other ones of everything else
THETA = np.array([[0.91, 0.55], [0.75, 1.1], [1.25, 0.45], [1.0, 1.0]])


class Bench:
    """Four noise-free engagements of one campaign."""

    def __init__(self, sharp: bool) -> None:
        self.campaign = ClutchCampaign(sharp)
        self.table = self.campaign.table().iloc[CASES]
        self.rig = self.campaign.rig
        self.current, self.run = self.campaign.simulate(self.table, THETA)
        self.t = PERIOD * np.arange(len(self.current))
        self.locked = self.t[:, None] >= self.run["shift"]


@pytest.fixture(scope="module", params=[False, True], ids=["mild", "sharp"])
def bench(request: pytest.FixtureRequest) -> Bench:
    return Bench(request.param)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench") / "logs"
    provenance = ClutchCampaign().write(folder, 3)
    assert provenance["data"] == "virtual" and provenance["seed"] == 3
    assert provenance["description"].endswith("parameters invented but plausible, not measurements")
    return folder


def test_the_shafts_meet_once_and_turn_together_from_there_on(bench: Bench) -> None:
    slip = bench.run["omega_1"] - bench.rig.R * bench.run["omega_2"]
    assert np.all((bench.run["shift"] > 0.3) & (bench.run["shift"] < 3.0))
    assert np.all(slip[~bench.locked] > 0.0)
    np.testing.assert_allclose(slip[bench.locked], 0.0, atol=1e-9)


def test_states_are_continuous_where_the_shafts_meet(bench: Bench) -> None:
    for name, fastest in (("omega_1", 1500.0), ("omega_2", 400.0), ("p", 1000.0), ("z", 200.0)):
        assert np.abs(np.diff(bench.run[name], axis=0)).max() < fastest * PERIOD


def test_energy_of_the_shafts_changes_by_the_work_done_on_them(bench: Bench) -> None:
    """Before: converter, brake and the heat of the clutch; after: converter and brake alone."""
    rig, run = bench.rig, bench.run
    setting = bench.table[["omega_m", "T_b0"]].to_numpy(float).T
    touch = rig.z_p * THETA[:, 1]
    slip = run["omega_1"] - rig.R * run["omega_2"]
    heat = np.where(bench.locked, 0.0, rig.clutch(run["p"], run["z"], slip, touch) * slip)
    brake = (setting[1] + rig.b * run["omega_2"]) * run["omega_2"]
    power = rig.converter(run["omega_1"], setting[0]) * run["omega_1"] - brake - heat
    gain = 0.5 * rig.J1 * run["omega_1"] ** 2 + 0.5 * rig.J2 * run["omega_2"] ** 2
    work = cumulative_trapezoid(power, bench.t, axis=0, initial=0.0)
    np.testing.assert_allclose(gain - gain[0], work, atol=2e-4 * np.ptp(gain), rtol=0.0)


def test_the_brake_holds_the_load_until_the_clutch_is_stronger(bench: Bench) -> None:
    assert np.all(bench.run["omega_2"] >= 0.0)
    assert np.all(bench.run["omega_2"][bench.t < 0.05] == 0.0)


def test_the_converter_multiplies_torque_at_stall_and_passes_none_at_equal_speed(bench: Bench) -> None:
    speed = np.array([157.08, 157.08])
    stall, equal = bench.rig.converter(np.array([0.0, 157.08]), speed)
    assert stall == pytest.approx(2.0 * 0.00487 * 157.08**2)
    assert equal == 0.0
    with pytest.raises(FloatingPointError):
        bench.rig.converter(np.array([0.0]), np.array([0.0]))


def test_pressure_and_piston_settle_where_the_current_holds_them(bench: Bench) -> None:
    """p = p_rest + Kp u and z~ = Kz (p - p_hc0) for a current that has stood long enough."""
    current = np.interp(bench.t[:4000], [0.0, 0.01], [0.0, 0.1])[:, None]
    setting = bench.campaign.setting(bench.table, THETA).only(0)
    run = bench.rig.simulate(current, PERIOD, setting)
    pressure = 0.2 + 20.0 * 0.1
    assert run["p"][0] == 0.2
    assert run["p"][-1] == pytest.approx(pressure, rel=1e-9)
    assert run["z"][0] == 0.0
    expected = bench.rig.Kz * (pressure - 0.91 * bench.rig.p_hc0)
    assert run["z"][-1] == pytest.approx(expected, rel=5e-3)


def test_a_clutch_that_is_never_filled_never_locks(bench: Bench) -> None:
    setting = bench.campaign.setting(bench.table, THETA)
    run = bench.rig.simulate(np.zeros((1000, 4)), PERIOD, setting)
    assert np.isnan(run["shift"]).all()
    np.testing.assert_array_equal(run["p"], 0.2)
    np.testing.assert_array_equal(run["omega_2"], 0.0)
    # the converter carries the drag of the open clutch, some newton metres
    drag = bench.rig.gamma / 2.0 * run["omega_1"][-1]
    driving = bench.rig.converter(run["omega_1"][-1], setting.omega_m)
    np.testing.assert_allclose(driving, drag, rtol=0.02)
    assert np.all((drag > 1.0) & (drag < 4.0))


def test_the_step_is_short_enough(bench: Bench) -> None:
    half = np.stack([np.interp(np.arange(16001) / 2, np.arange(8001), u) for u in bench.current.T], axis=1)
    setting = bench.campaign.setting(bench.table, THETA)
    finer = bench.rig.simulate(half[:6001], PERIOD / 2, setting)
    done = np.isfinite(finer["shift"])
    assert done.sum() >= 2
    np.testing.assert_allclose(finer["shift"][done], bench.run["shift"][done], atol=1e-6, rtol=0.0)


def known_shift(system: System, theta: np.ndarray, row: Any, t: np.ndarray, current: np.ndarray) -> float:
    """When the system file's shafts meet, by an adaptive method."""
    value = {q.name: q.value for q in system.parameters}
    p = system.with_values({"p_hc0": theta[0] * value["p_hc0"], "z_p": theta[1] * value["z_p"]}).values
    rates = numpy_system_function(system, system.dynamics, efforts_zero=True)
    slip = numpy_system_function(system, [system.events[0].expression], efforts_zero=True)
    rest = None, np.array(p), np.array([row.omega_m, row.T_b0])

    def met(at: float, x: np.ndarray) -> float:
        return float(slip(at, x, np.zeros(1), *rest)[0])

    met.terminal, met.direction = True, -1  # type: ignore[attr-defined]
    start = [float(state.initial) for state in system.states[:3]] + [0.999 * row.omega_m, 0.0]
    how = {"rtol": 1e-6, "atol": [1.0, 10.0, 1e-9, 1e-5, 1e-5], "max_step": 0.004, "events": met}
    rate = lambda at, x: rates(at, x, [np.interp(at, t, current)], *rest)  # noqa: E731
    return float(solve_ivp(rate, (0.0, t[-1]), start, "RK45", **how).t_events[0][0])


def test_the_known_model_shifts_at_the_same_time_given_the_true_theta(bench: Bench) -> None:
    system = read_system(SYSTEMS / ("clutch_sharp.yaml" if bench.campaign.sharp else "clutch.yaml"))
    for i, row in enumerate(bench.table.itertuples()):
        found = known_shift(system, THETA[i], row, bench.t, bench.current[:, i])
        assert found == pytest.approx(bench.run["shift"][i], abs=1e-4)


def test_theta_is_normal_between_its_bounds() -> None:
    wide = ClutchCampaign(alpha=(0.8, 1.1, 0.1, 0.2))
    draws = np.array([wide.draw(np.random.default_rng([1, k])) for k in range(2000)])
    for column, (low, high), mean, deviation in zip(draws.T, BOX, (0.8, 1.1), (0.1, 0.2), strict=True):
        assert low <= column.min() and column.max() <= high
        outside = np.random.default_rng(5).normal(mean, deviation, 200_000)
        inside = outside[(outside > low) & (outside < high)]
        for level in (0.1, 0.5, 0.9):
            expected = float(np.quantile(inside, level))
            assert np.quantile(column, level) == pytest.approx(expected, abs=0.1 * deviation)


def test_campaign_has_108_engagements(campaign: Path) -> None:
    table = pd.read_csv(campaign / "experiments.csv")
    assert list(table.columns) == ["id", "file", "u1", "u2", "u3", "omega_m", "T_b0", "rpm", "profile"]
    assert len(table) == 108
    assert table["id"].is_unique
    factors = table[["profile", "rpm", "T_b0"]].drop_duplicates()
    assert len(factors) == 108 and factors["profile"].max() == 18
    assert len(table[["u1", "u2", "u3"]].drop_duplicates()) == 18
    np.testing.assert_allclose(table["omega_m"], table["rpm"] * np.pi / 30.0, atol=1e-4)
    assert sum(p.stat().st_size for p in campaign.iterdir()) < 40e6


def test_logs_are_those_of_the_engagements_with_noise(campaign: Path) -> None:
    truth = json.loads((campaign / "bench.json").read_text())
    table = pd.read_csv(campaign / "experiments.csv").iloc[CASES]
    theta = np.array([truth["theta"][name] for name in table["id"]])
    current, run = ClutchCampaign().simulate(table, theta)
    shifted = [truth["shifting_time"][name] for name in table["id"]]
    np.testing.assert_allclose(run["shift"], shifted, rtol=1e-12)
    for i, row in enumerate(table.itertuples()):
        log = pd.read_csv(campaign / row.file)
        assert list(log.columns) == ["t", "current", "pressure", "omega_1", "omega_2"]
        assert len(log) == 8001 and log["t"].iloc[-1] == 4.0
        np.testing.assert_array_equal(log["current"], current[:, i])
        for name, true, noise in (
            ("pressure", 1e5 * run["p"], 2000.0),
            ("omega_1", run["omega_1"], 0.2),
            ("omega_2", run["omega_2"], 0.1),
        ):
            residual = log[name] - true[:, i]
            assert residual.std() == pytest.approx(noise, rel=0.05)
            assert abs(residual.mean()) < 0.05 * noise


def test_currents_pulse_hold_and_rise(campaign: Path) -> None:
    table = pd.read_csv(campaign / "experiments.csv")
    for _, rows in table.groupby("profile"):
        first = rows.iloc[0]
        logs = [pd.read_csv(campaign / file)["current"] for file in rows["file"].iloc[:2]]
        np.testing.assert_array_equal(*logs)
        t, u = PERIOD * np.arange(8001), logs[0].to_numpy()
        assert u[0] == 0.0
        np.testing.assert_array_equal(u[(t > 0.0021) & (t < first["u1"] - 1e-6)], 0.35)
        ramp = (t > first["u1"] + 0.0021) & (u < 0.599)
        expected = first["u2"] + first["u3"] * (t - first["u1"])
        np.testing.assert_allclose(u[ramp], expected[ramp], atol=1e-5)
        assert u.max() <= 0.6


def test_same_seed_same_bytes_other_seed_other_clutch(campaign: Path, tmp_path: Path) -> None:
    ClutchCampaign().write(tmp_path / "same", 3)
    for file in ("E1.csv", "E108.csv", "experiments.csv", "bench.json"):
        assert (tmp_path / "same" / file).read_bytes() == (campaign / file).read_bytes()
    drawn = json.loads((campaign / "bench.json").read_text())["theta"]
    assert len({tuple(theta) for theta in drawn.values()}) == 108
    for seed, same in ((3, True), (4, False)):
        theta = ClutchCampaign().draw(np.random.default_rng([seed, 1])).tolist()
        assert (theta == drawn["E1"]) is same


@pytest.mark.parametrize(
    ("alpha", "words"),
    [
        ((1.0, 1.0, 0.1), "two means within"),
        ((1.0, 1.0, 0.1, 0.1, 0.1), "two means within"),
        ((0.6, 1.0, 0.1, 0.1), "two means within"),
        ((1.0, 1.2, 0.1, 0.1), "two means within"),
        ((float("nan"), 1.0, 0.1, 0.1), "two means within"),
        ((1.0, 1.0, 0.0, 0.1), "positive"),
        ((1.0, 1.0, 0.1, float("inf")), "positive"),
        ((1.0, "a", 0.1, 0.1), "four numbers"),
        ((1.0,), "four numbers"),
        (3.0, "four numbers"),
    ],
)
def test_a_campaign_that_cannot_be_run_is_refused(alpha: Any, words: str) -> None:
    with pytest.raises(BadInput, match=r"^source\.alpha") as caught:
        ClutchCampaign(alpha=alpha)
    assert words in str(caught.value)


def test_the_two_benches_are_those_of_the_two_system_files() -> None:
    """Constants in bar, mm here and in SI units there."""
    scale = {"Kp": 1e5, "p_rest": 1e5, "b2": 1e5, "Kz": 1e-8, "c2": 1e-8, "p_hc0": 1e5, "alpha": 1e-5}
    scale |= {"z_M": 1e-3, "z_p": 1e-3, "w_delta": 1e-3, "gap": 1e-3, "gamma": 1e-3}
    other = {"gap": "gap_min", "J1": "J_1", "J2": "J_2", "ratio": "f_0", "slope": "f_1", "C0": "C_0"}
    for sharp, name in ((False, "clutch"), (True, "clutch_sharp")):
        campaign, system = ClutchCampaign(sharp), read_system(SYSTEMS / f"{name}.yaml")
        given = {q.name: q for q in system.parameters}
        rig = vars(campaign.rig)
        assert len(rig) == len(given) - 1  # the bench's brake holds exactly, the model's with k_h
        for key, value in rig.items():
            assert given[other.get(key, key)].value == pytest.approx(value * scale.get(key, 1.0), rel=1e-12)
        for key, bounds in zip(("p_hc0", "z_p"), BOX, strict=True):
            assert given[key].bounds == pytest.approx([b * given[key].value for b in bounds])
        assert campaign.rig != replace(ClutchCampaign(not sharp).rig)
