"""Identification of a distribution: plant and recover, from a callable and from a system with its logs."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.__main__ import main
from pipeline.rigs import clutch
from pipeline.rigs.clutch import ClutchCampaign
from tests.machines.known import SYSTEMS, Array, built_in
from unmodelled import Logs, System, read_logs
from unmodelled.base.errors import BadInput
from unmodelled.engine.cascade.event_times import EventTimes
from unmodelled.learning.uncertainty import problem
from unmodelled.learning.uncertainty.estimate import Estimator, least_squares
from unmodelled.learning.uncertainty.problem import event_response, inputs, same_starts
from unmodelled.learning.uncertainty.setup import Setup, pairs
from unmodelled.uncertainty.chaos import Chaos
from unmodelled.uncertainty.families import ClippedNormal
from unmodelled.uncertainty.identify import Settings
from unmodelled.uncertainty.methods import METHODS
from unmodelled.uncertainty.propagation import ChaosMaximumEntropy
from unmodelled.uncertainty.response import Formula

POINTS = 60
SETUP = Setup(ClippedNormal, (0.01, 0.3), nodes=(15, 9), search=Settings(16, 40, 0.05))


def outputs(theta: Array) -> Array:
    """Sixty outputs whose slopes by the two parameters differ."""
    weight = np.linspace(0.2, 1.0, POINTS)
    return np.exp(weight * theta[:, :1]) + weight[::-1] * theta[:, 1:] ** 2


def model() -> Formula:
    return problem.callable_response(outputs, ["a", "b"], [[0.5, 1.5], [0.5, 1.5]])


@pytest.mark.long
@pytest.mark.parametrize("method", METHODS)
def test_a_planted_distribution_is_recovered(method: str) -> None:
    truth = np.array([0.9, 1.1, 0.1, 0.05])
    estimator = Estimator(SETUP, SETUP.surface(model()))
    drawn = estimator.draw(pairs(truth), 12, 0)
    found = np.array([f.alpha for f in estimator.identify_all(method, drawn, 0, 2)])
    error = np.median(found, axis=0) - truth
    assert np.all(np.abs(error) < [0.03, 0.03, 0.02, 0.03])


def test_the_deterministic_fit_is_that_of_least_squares() -> None:
    y = outputs(np.array([[0.8, 1.2]]))[0]
    estimator = Estimator(SETUP, SETUP.surface(model()))
    np.testing.assert_allclose(least_squares(estimator.surface, y), [0.8, 1.2], atol=2e-3)


def observations(folder: Path, y: Array) -> Path:
    path = folder / "y.csv"
    pd.DataFrame({"id": [f"P{k}" for k in range(len(y))], "y": y}).to_csv(path, index=False)
    return path


def test_setups_that_make_no_sense_are_refused() -> None:
    with pytest.raises(BadInput, match="deviations: must be positive and increase"):
        replace(SETUP, deviations=(0.0, 0.1))
    with pytest.raises(BadInput, match="bounds: must be"):
        problem.callable_response(outputs, ["a", "b"], [[1.5, 0.5], [0.5, 1.5]])


def command(*arguments: object) -> int:
    try:
        return main([str(a) for a in arguments])
    except SystemExit as leave:
        return int(leave.code or 0)


def callable_named(function: str) -> str:
    """The command-line argument for a function of this module."""
    target = "_target_: unmodelled.learning.uncertainty.problem.callable_response"
    inner = f"{{_target_: {__name__}.{function}, _partial_: true}}"
    return f"response={{{target}, names: [a, b], bounds: [[0.5, 1.5], [0.5, 1.5]], function: {inner}}}"


SHORT = "uncertainty.search.generations=3", "uncertainty.nodes=[9,9]", "profile=quick", "profile.data_sets=2"


@pytest.fixture(scope="module")
def clutch_logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs of twelve engagements: one profile in nine of the bench."""
    folder = tmp_path_factory.mktemp("clutch") / "raw"
    ClutchCampaign().write(folder, 0)
    table = pd.read_csv(folder / "experiments.csv")
    table[table["profile"].isin([4, 15])].to_csv(folder / "experiments.csv", index=False)
    return folder


@pytest.mark.long
def test_the_moments_of_an_event_come_from_logs_and_from_the_model(clutch_logs: Path) -> None:
    found = problem.read_problem(SYSTEMS / "clutch.yaml", clutch_logs, None, None, None, None, None)
    truth = json.loads((clutch_logs / "bench.json").read_text())
    ids = pd.read_csv(clutch_logs / "experiments.csv")["id"].tolist()
    theta = np.array([truth["theta"][name] for name in ids])
    shift = np.array([truth["shifting_time"][name] for name in ids])
    assert found.response.names == ("p_hc0", "z_p") and found.ids == tuple(ids)
    np.testing.assert_allclose(found.response.bounds, [[0.7, 1.3], [0.4, 1.15]])
    np.testing.assert_allclose(found.y, shift, atol=2e-3)
    np.testing.assert_allclose(np.diag(found.response(theta)), found.y, atol=3e-3)


@pytest.fixture(scope="module")
def identified(clutch_logs: Path) -> Path:
    out = clutch_logs.parent / "found"
    arguments = ("system=systems/clutch.yaml", f"logs={clutch_logs}", f"out={out}")
    assert command("identify_uncertainty", *arguments, *SHORT) == 0
    return out


@pytest.mark.long
def test_the_verb_identifies_a_system(identified: Path) -> None:
    found = json.loads((identified / "uncertainty.json").read_text())
    assert set(found["methods"]) == set(METHODS) and found["observations"] == 12 and found["advice"]
    estimates = pd.read_parquet(identified / "estimates.parquet")
    assert set(estimates["name"]) == {"mu_1", "mu_2", "sigma_1", "sigma_2"}
    profiles = pd.read_parquet(identified / "profiles.parquet")
    assert (profiles["deviance"] >= 0.0).all()
    points = pd.read_parquet(identified / "points.parquet")
    total = points["log_likelihood_push_forward"].sum()
    assert total == pytest.approx(found["methods"]["push_forward"]["log_likelihood"], abs=1e-2)


@pytest.mark.long
def test_the_methods_are_assessed(identified: Path, clutch_logs: Path, tmp_path: Path) -> None:
    sizes = ("profile.samples=2000", "profile.sampling_repeats=2", "fine=[41,31]")
    arguments = ("system=systems/clutch.yaml", f"logs={clutch_logs}", f"found={identified}")
    truth = f"truth={clutch_logs / 'bench.json'}"
    out = tmp_path / "assessed"
    assert command("assess_uncertainty", *arguments, truth, *sizes, *SHORT, f"out={out}") == 0
    accuracy = pd.read_parquet(out / "accuracy.parquet")
    mean = accuracy[accuracy["alpha_of"] == "planted"].groupby("method")["emd"].mean()
    assert mean["push_forward"] < mean["maximum_entropy"] < mean["gaussian"]
    sampled = pd.read_parquet(out / "sampling.parquet").groupby("samples")["mae"].mean()
    assert sampled[3200] < sampled[25]
    assert command("assess_uncertainty", *arguments, "shown=99", f"out={out}") == 2


@pytest.mark.long
def test_the_verb_takes_a_python_function(tmp_path: Path) -> None:
    y = np.diag(outputs(np.random.default_rng(0).normal([0.9, 1.1], [0.1, 0.05], (POINTS, 2))))
    places = f"observations={observations(tmp_path, y)}", f"out={tmp_path / 'o'}"
    assert command("identify_uncertainty", callable_named("outputs"), *places, *SHORT) == 0
    assert json.loads((tmp_path / "o" / "uncertainty.json").read_text())["parameters"] == ["a", "b"]


def wavy(theta: Array) -> Array:
    return np.tile(np.sin(9.0 * theta[:, :1]) + np.cos(9.0 * theta[:, 1:]), (1, POINTS))


def gone(theta: Array) -> Array:
    return np.where(theta[:, :1] > 1.2, np.nan, outputs(theta))


@pytest.mark.long
@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ([callable_named("wavy")], "non-monotone response"),
        ([callable_named("gone")], "the event does not happen at theta"),
        (["uncertainty.moments=1"], "moments"),
        (["uncertainty.order=4"], "the quadrature order must exceed the degree 4"),
        (["uncertainty.nodes=[2,9]"], "nodes must be at least 3"),
        (["uncertainty.deviations=[0.3,0.2]"], "deviations: must be positive"),
        (["observations=nowhere.csv"], "nowhere.csv: no such file"),
        (["system=systems/clutch.yaml"], "give system=... and logs=..., or response"),
        (["observations=empty.csv"], "no observations below it"),
    ],
)
def test_refusals(changes: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = observations(tmp_path, np.linspace(2.0, 3.0, POINTS))
    (tmp_path / "empty.csv").write_text("id,y\n")
    changes = [c.replace("=empty.csv", f"={tmp_path / 'empty.csv'}") for c in changes]
    keys = {c.split("=")[0] for c in changes}
    usual = callable_named("outputs"), f"observations={path}", *SHORT
    given = [a for a in usual if a.split("=")[0] not in keys]
    assert command("identify_uncertainty", *given, *changes, f"out={tmp_path / 'out'}") == 2
    line = capsys.readouterr().err.strip().splitlines()[-1]
    assert line.startswith("error: ") and said in line
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_missing_events(clutch_logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    known = ("system=systems/clutch.yaml", f"logs={clutch_logs}", f"out={tmp_path / 'o'}")
    for change, said in (
        ("event=stop", "has no event 'stop'"),
        ("uncertain=[p_0]", "has no parameter 'p_0'"),
        ("step=0.0007", "step must be a multiple of the period"),
    ):
        assert command("identify_uncertainty", *known, change) == 2
        assert said in capsys.readouterr().err
    assert command("identify_uncertainty", "system=systems/pendulum.yaml", *known[1:]) == 2
    assert "events: must be one" in capsys.readouterr().err


@pytest.mark.parametrize("sharp", [pytest.param(False, marks=pytest.mark.long), True])
def test_maximum_entropy_converges_for_all_operating_points(sharp: bool) -> None:
    campaign, system = ClutchCampaign(sharp), built_in("clutch_sharp" if sharp else "clutch")
    table = campaign.table()
    t = np.arange(4001) * 1e-3
    u = np.array([campaign.profiles.current(t, *row) for row in table[["u1", "u2", "u3"]].to_numpy()])
    c = table[["omega_m", "T_b0"]].to_numpy(float)
    x0 = np.zeros((len(table), 5))
    x0[:, 0], x0[:, 3] = 2e4, 0.999 * c[:, 0]
    response = EventTimes.of(system, "shift", system.uncertain, u[:, :, None], 1e-3, c, x0, 4e-3)
    for alpha in ([0.91, 0.55, 0.081, 0.046], [0.91, 0.55, 0.077, 0.014], [1.0, 1.0, 0.07, 0.02]):
        chaos = Chaos(SETUP.families(response), SETUP.degree, SETUP.order)
        found = ChaosMaximumEntropy(response, chaos, SETUP.moments)(pairs(alpha))
        assert not found.fallback.any() and found.fallback.shape == (108,)


UNCERTAIN = ("p_hc0", "z_p")
Truth = dict[str, dict[str, list[float]]]


class TwoProfiles(ClutchCampaign):
    """The twelve engagements with the ninth and the tenth profile."""

    def table(self) -> pd.DataFrame:
        return super().table().iloc[48:60]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[Logs, System, Truth]:
    """Logs, the last of which ends after 0.4 s, and what the bench knows of them."""
    folder = tmp_path_factory.mktemp("bench") / "logs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clutch, "PERIOD", 0.002)
        TwoProfiles().write(folder, 5)
    pd.read_csv(folder / "E60.csv").iloc[:201].to_csv(folder / "E60.csv", index=False)
    system = built_in("clutch")
    return read_logs(folder, system), system, json.loads((folder / "bench.json").read_text())


def test_times_of_the_bench(bench: tuple[Logs, System, Truth]) -> None:
    """At the theta of each engagement: that one comes out, whatever the others."""
    logs, system, truth = bench
    found = event_response(system, "shift", UNCERTAIN, logs, 0.004)
    assert [len(same.members) for same in found.inputs] == [6, 6]
    own = np.diag(found(np.array([truth["theta"][name] for name in logs.ids])))
    expected = np.array([truth["shifting_time"][name] for name in logs.ids])
    assert logs.ids[-1] == "E60"
    assert expected[-1] > 0.4
    assert np.isnan(own[-1])
    # the measured start of the shafts is noisy
    np.testing.assert_allclose(own[:-1], expected[:-1], rtol=0.0, atol=3e-3)


def test_a_log_that_ends_goes_on_like_one_that_begins_alike(bench: tuple[Logs, System, Truth]) -> None:
    logs, _, _ = bench
    u, group = inputs(logs)
    np.testing.assert_array_equal(group, np.repeat([0, 1], 6))
    np.testing.assert_array_equal(u[11], u[10])
    np.testing.assert_array_equal(u[0], logs.u[logs.rows(0)])
    other = replace(logs, u=logs.u.copy())
    other.u[logs.offsets[11]] += 0.1
    u, group = inputs(other)
    np.testing.assert_array_equal(group, [0] * 6 + [1] * 5 + [2])
    assert set(u[11, 200:, 0]) == {other.u[-1, 0]}


def test_starts_that_differ_by_noise_are_one() -> None:
    group, start = np.array([0, 0, 0, 1, 1, 2]), np.array([1.0, 1.2, 1.1, 3.0, 5.0, 7.0])
    np.testing.assert_allclose(same_starts(group, start, 0.1), [1.1, 1.1, 1.1, 3.0, 5.0, 7.0])
    assert len(set(same_starts(group, start, 0.1)[:3])) == 1
    np.testing.assert_array_equal(same_starts(group, start, 0.0), start)
