"""Which parameters can be identified together, alone and beside networks, where the answer is known."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.rigs.slider_crank import SliderCrankCampaign
from tests.machines.folders import Array, logs_of, system_of, text_of
from unmodelled.base.errors import BadInput
from unmodelled.cli.verbs.identifiability import identifiability
from unmodelled.design.advice import advise
from unmodelled.design.identifiability import COLLINEAR, Identifiability, collinearity, identify_sets
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

#: Rates of three sines, rad/s.
RATES = (1.3, 3.1, 7.7)


def motion(rates: tuple[float, ...], start: float) -> tuple[Array, Array, Array, Array]:
    """Time, position, velocity and acceleration of a sum of sines, each as large in velocity."""
    t = np.arange(0.0, 6.0, 0.004)
    w, size = np.array(rates)[:, None], 2.0 / len(rates)
    phase = w * t + start * (1.0 + np.arange(len(rates)))[:, None]
    x, v, a = (size / w * np.sin(phase), size * np.cos(phase), -size * w * np.sin(phase))
    return t, x.sum(0), v.sum(0), a.sum(0)


def acceleration_of(rates: tuple[float, ...]) -> float:
    """Root mean square acceleration of the motions that start at 0.2 and at 1.1."""
    return float(np.sqrt(np.mean([motion(rates, start)[3] ** 2 for start in (0.2, 1.1)])))


def read(folder: Path, text: str, logs: list[dict[str, Array]]) -> tuple[System, Logs]:
    system = system_of(text, folder)
    return system, logs_of(system, folder, logs)


Judged = tuple[System, Identifiability]
SLIDER_CRANK = Path(__file__).parents[2] / "systems" / "slider_crank.yaml"

OSCILLATOR = text_of("oscillator.yaml")


def driven(start: float) -> dict[str, Array]:
    """A log of the oscillator."""
    t, x, v, a = motion(RATES, start)
    return {"t": t, "x": x, "v": v, "u": (2.0 * a + 3.0 * v + 50.0 * x) / 4.0}


@pytest.fixture
def oscillator(tmp_path: Path) -> tuple[System, Logs]:
    return read(tmp_path, OSCILLATOR, [driven(0.2), driven(1.1)])


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bench")
    SliderCrankCampaign().write(folder, seed=0)
    return folder


@pytest.fixture(scope="module")
def slider_crank(bench: Path) -> Judged:
    system = read_system(SLIDER_CRANK)
    return system, identify_sets(system, read_logs(bench, system))


def test_the_slider_crank_is_as_the_text_says(slider_crank: Judged) -> None:
    system, result = slider_crank
    first = sorted(system.p, key=lambda p: -result.norms[str(p)])[:3]
    assert {str(p) for p in first} == {"l1", "J1", "m3"}
    assert result.norms["F"] > 0.3
    assert result.correlation_of("l1", "m3") > 0.9
    assert result.correlation_of("l1", "m2") > 0.8
    assert all(abs(result.correlation_of("F", p)) < 0.3 for p in result.found.parameters)
    assert result.judge(("m3", "J1", "B_m")).both
    assert result.judge(("l1", "J1", "B_m")).both
    together = result.judge(("l1", "m3", "J1", "B_m"))
    assert not together.identifiable
    assert not together.with_network
    sentences = advise(system, result)
    assert any(s.startswith("l1 and m3 must be separated: their effects") for s in sentences)
    assert any(s.startswith("{m3, J1, B_m}, marked in the system file, can be") for s in sentences)
    assert any(s.startswith("m1 hardly matters") for s in sentences)


def test_the_best_sets_come_first_and_have_no_identifiable_superset(slider_crank: Judged) -> None:
    sets = slider_crank[1].sets
    assert sets[0].maximal
    order = [(not s.maximal, not s.both) for s in sets]
    assert order == sorted(order)
    for s in sets:
        larger = any(o.both and {*s.names} < {*o.names} for o in sets)
        assert s.maximal == (s.both and not larger)


def test_only_ratios_of_an_oscillator_can_be_identified(oscillator: tuple[System, Logs]) -> None:
    result = identify_sets(*oscillator, ["m", "k", "b", "K"], floor=0.0)
    together = result.judge(("m", "k", "b", "K"))
    assert together.collinearity > 100.0
    assert not together.identifiable
    for left_out in range(4):
        names = tuple(n for i, n in enumerate("mkbK") if i != left_out)
        loose = identify_sets(*oscillator, names, limit=20.0, floor=0.0)
        assert loose.judge(names).both
    assert any("identified together" in s or "must be separated" in s for s in advise(oscillator[0], result))


def test_without_ports_networks_leave_everything(oscillator: tuple[System, Logs]) -> None:
    result = identify_sets(*oscillator)
    moving = [n for n in result.found.parameters if n != "spare"]
    assert [result.unabsorbed[n] for n in moving] == [1.0] * len(moving)
    assert all(s.collinearity == pytest.approx(s.collinearity_with_network) for s in result.sets)


def test_a_parameter_that_acts_nowhere(oscillator: tuple[System, Logs]) -> None:
    result = identify_sets(*oscillator)
    assert result.norms["spare"] == 0.0
    assert not any("spare" in s.names for s in result.sets)
    told = "spare has no effect on the derivative of any state: hold it fixed"
    assert told in advise(oscillator[0], result)
    with pytest.raises(BadInput, match="no derivative of a state depends on spare"):
        identify_sets(*oscillator, ["spare"])


def test_columns_are_in_units_of_the_parameter_and_the_derivative(oscillator: tuple[System, Logs]) -> None:
    system, logs = oscillator
    result = identify_sets(system, logs)
    acceleration = acceleration_of(RATES)
    stretch = np.sqrt(np.mean(logs.x[:, 0] ** 2))
    assert result.norms["k"] == pytest.approx(50.0 * stretch / 2.0 / acceleration, rel=0.01)
    # a value of zero has no size: half the width of the bounds
    assert result.norms["offset"] == pytest.approx(4.0 / 2.0 / acceleration, rel=0.01)


SERVO = text_of("servo.yaml")


def test_a_known_gear_ratio_does_not_hide_what_is_to_be_identified(tmp_path: Path) -> None:
    """Supply and back-EMF nearly cancel: the ratio changes the acceleration by many times its size."""
    t, q, w, a = motion((0.3, 0.7, 1.7), 0.2)
    u = ((0.01 + 350.0**2 * 2e-7) * a + 0.012 * w) * 4.0 / (350.0 * 0.004) + 350.0 * 0.004 * w
    result = identify_sets(*read(tmp_path, SERVO, [{"t": t, "q": q, "w": w, "u": u}]))
    assert result.norms["n"] > 20.0 * result.norms["J"] and 0.05 < result.norms["J"] < 1.0
    assert {"J", "b"} <= {*result.sensitive}
    assert result.judge(("J", "b")).both


def test_a_state_that_no_output_shows_is_noted(tmp_path: Path) -> None:
    text = OSCILLATOR.replace("v: {unit: m/s}}\ninputs", "v: {unit: m/s}, F: {unit: N}}\ninputs")
    text = text.replace("(K*u - k*x", "(F - k*x").replace("+ offset)/m}", "+ offset)/m, F: (K*u - F)/lag}")
    text = text.replace("  spare: {value: 1.0, unit: kg}", "  lag: {value: 0.1, unit: s}")
    result = identify_sets(*read(tmp_path, text, [driven(0.2)]))
    assert result.norms["lag"] > 0.0
    assert "F: not measured; the result assumes that its derivative is measured" in result.found.notes


@pytest.mark.parametrize("correlation", [0.0, 0.5, -0.96])
def test_collinearity_of_a_pair(correlation: float) -> None:
    found = collinearity(np.array([[1.0, correlation], [correlation, 1.0]]), [0, 1])
    assert found == pytest.approx(1.0 / np.sqrt(1.0 - abs(correlation)))


def test_collinearity_of_the_same_column_twice() -> None:
    assert collinearity(np.ones((2, 2)), [0, 1]) == pytest.approx(COLLINEAR, rel=1e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"parameters": ["m", "mass"]}, "'mass' is not a parameter of oscillator, must be one of m, k, b, K"),
        ({"parameters": ["m", "k", "m"]}, "parameters: 'm' is named twice"),
        ({"parameters": []}, "parameters: must name at least one"),
        ({"limit": 1.0}, "limit must be larger than 1, got 1"),
        ({"limit": float("nan")}, "limit must be larger than 1, got nan"),
        ({"floor": 1.5}, "floor must be at least 0 and less than 1, got 1.5"),
    ],
)
def test_wrong_arguments(
    oscillator: tuple[System, Logs], arguments: dict[str, list[str] | float], message: str
) -> None:
    with pytest.raises(BadInput, match=message):
        identify_sets(*oscillator, **arguments)  # type: ignore[arg-type]


def test_the_stage_writes_and_prints(bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    identifiability(SLIDER_CRANK, bench, ["l1", "m3", "J1", "B_m"], 5.0, 0.05, out)
    printed = capsys.readouterr().out
    content = json.loads((out / "identifiability.json").read_text())
    assert content["schema"] == "identifiability/1"
    assert content["parameters"]["l1"]["unit"] == "m"
    assert content["efforts"]["F"]["port"] == "slider"
    assert content["correlation"]["l1"]["m3"] > 0.9
    assert content["sets"][0]["names"] == ["l1", "J1", "B_m"]
    assert all(f"- {sentence}" in printed for sentence in content["advice"])
    table = pd.read_parquet(out / "advice.parquet")
    assert len(table) == 15
    assert not table.set_index("set").loc["l1, m3, J1, B_m", ["identifiable", "with_network"]].any()
    assert table.set_index("set").loc["m3, J1, B_m", ["identifiable", "with_network"]].all()
    kinds = pd.read_parquet(out / "sensitivity.parquet").set_index("name")
    assert kinds["kind"].to_dict() == {"F": "effort"} | dict.fromkeys(("l1", "m3", "J1", "B_m"), "parameter")
    assert kinds["unabsorbed"].isna().to_dict()["F"]
    assert len(pd.read_parquet(out / "correlation.parquet")) == 25


@pytest.mark.parametrize(("key", "value"), [("parameters", "m3"), ("limit", "five"), ("floor", None)])
def test_the_stage_refuses_wrong_types(key: str, value: object, bench: Path, tmp_path: Path) -> None:
    arguments = {"parameters": None, "limit": 5.0, "floor": 0.05, key: value}
    with pytest.raises(BadInput, match=f"^{key}: must be"):
        identifiability(SLIDER_CRANK, bench, **arguments, out=tmp_path / "out")  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


PENDULUM = text_of("weighted_pendulum.yaml")


def pendulum(folder: Path, rates: tuple[float, ...], text: str = PENDULUM) -> tuple[System, Logs]:
    """Runs whose load tau = 0.3 omega the model leaves out."""
    logs = []
    for start in (0.2, 1.1):
        t, x, v, a = motion(rates, start)
        torque = 0.5 * a + 2.0 * np.sin(x) + 0.3 * v
        logs.append({"t": t, "theta": x, "omega": v, "torque": torque})
    return read(folder, text, logs)


def test_a_network_absorbs_gravity_but_not_inertia(tmp_path: Path) -> None:
    system, logs = pendulum(tmp_path, RATES)
    result = identify_sets(system, logs)
    assert result.absorbed == ("weight",)
    assert result.unabsorbed["J"] > 0.2
    assert [s.names for s in result.sets if s.with_network] == [("J",)]
    sentences = advise(system, result)
    assert any(s.startswith("weight is absorbed by the network in port joint") for s in sentences)
    assert any(s.startswith("{J, weight}, marked in the system file, cannot") for s in sentences)


def test_a_network_absorbs_inertia_where_the_motion_says_it_all(tmp_path: Path) -> None:
    """One sine: the acceleration is a function of the position."""
    result = identify_sets(*pendulum(tmp_path, (3.1,)))
    assert result.absorbed == ("J", "weight")
    assert not any(s.with_network for s in result.sets)
    assert result.judge(("J",)).collinearity_with_network == COLLINEAR


def test_the_effort_is_what_the_logs_need(tmp_path: Path) -> None:
    system, logs = pendulum(tmp_path, RATES)
    load = 0.3 * np.sqrt(np.mean(logs.x[:, 1] ** 2))
    expected = load / 0.5 / acceleration_of(RATES)
    assert identify_sets(system, logs).norms["tau"] == pytest.approx(expected, rel=0.02)


def test_an_effort_that_enters_nonlinearly_is_found_too(tmp_path: Path) -> None:
    text = PENDULUM.replace("- tau)/J", "- (tau + tau**3))/J").replace("unit: N m,", "unit: '',")
    text = text.replace(", velocity: omega}", "}")
    for unit in ("rad/s", "rad", "N m", "kg m^2"):
        text = text.replace(f"unit: {unit}", "unit: ''")
    system, logs = pendulum(tmp_path, RATES, text)
    load = 0.3 * logs.x[:, 1]
    tau = np.array([np.real(r[np.abs(r.imag) < 1e-9][0]) for r in (np.roots([1, 0, 1, -f]) for f in load)])
    expected = np.sqrt(np.mean(((1.0 + 3.0 * tau**2) / 0.5) ** 2) * np.mean(tau**2))
    found = identify_sets(system, logs).norms["tau"]
    assert found == pytest.approx(expected / acceleration_of(RATES), rel=0.03)


def test_two_ports_with_the_same_effect_are_no_fault_of_the_parameters(tmp_path: Path) -> None:
    text = PENDULUM.replace("dynamics:", "  second: {effort: mu, unit: N m, position: theta}\ndynamics:")
    result = identify_sets(*pendulum(tmp_path, RATES, text.replace("- tau)", "- tau - mu)")))
    assert result.correlation_of("tau", "mu") == pytest.approx(1.0)
    assert result.judge(("J",)).both


def test_samples_without_a_value_are_left_out(tmp_path: Path) -> None:
    text = PENDULUM.replace("weight*sin(theta)", "weight*sqrt(theta + 0.5)")
    result = identify_sets(*pendulum(tmp_path, RATES, text))
    assert any("samples at which a derivative has no value were left out" in n for n in result.found.notes)
    assert np.isfinite(result.found.matrix).all()
