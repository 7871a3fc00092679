"""The methods of the comparison recover what they can, and the tables of the page are those of its files."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled as um
from benchmarks.head_to_head import page
from benchmarks.head_to_head.__main__ import METHODS, compared, method, rows
from benchmarks.head_to_head.joints import BIAS, DELAY, QUANTITIES, JointFit
from benchmarks.head_to_head.method import gap_of
from tests.machines.folders import motion, system_of
from unmodelled.diagnosis.data.study import Study

CART = """schema: system/1
name: cart
states: {x: {unit: m}, v: {unit: m/s}}
inputs: {F: {unit: N}}
outputs: {x: {unit: m}, v: {unit: m/s}}
parameters: {M: {value: 2.2, unit: kg, identify: true, bounds: [1, 4]}}
ports: {rail: {effort: F_r, unit: N, position: x, velocity: v}}
dynamics: {x: v, v: (F - F_r)/M}
"""
MASS, VISCOUS, DRY, PERIOD = 2.0, 1.5, 0.4, 0.01


def planted(folder: Path) -> Study:
    """A cart of 2 kg with viscous and dry friction; its file has 2.2 kg and no friction."""
    system = system_of(CART, folder)
    t, frames = PERIOD * np.arange(400), {}

    def rates(x: np.ndarray, u: np.ndarray) -> list[np.ndarray]:
        return [x[1], (u - VISCOUS * x[1] - DRY * np.tanh(x[1] / 0.005)) / MASS]

    for run in range(4):
        rng = np.random.default_rng(run)
        force = 4.0 * np.sin(2.0 * np.pi * (0.5 + 0.3 * run) * t + run)
        states = motion(rates, [0.0, 0.0], force, PERIOD)
        shown = states + rng.normal(0.0, [1e-4, 1e-3], states.shape)
        frames[f"run{run}"] = pd.DataFrame({"t": t, "F": force, "x": shown[:, 0], "v": shown[:, 1]})
    return Study.of(system, um.Logs.from_frames(frames, system), 0.5, 0)


@pytest.fixture(scope="module")
def cart(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return planted(tmp_path_factory.mktemp("cart"))


def test_joint_parameters_that_repeat_one_of_the_file_are_left_out(cart: Study) -> None:
    fit = JointFit.of(cart, [*QUANTITIES.values(), BIAS, DELAY])
    added = [effect.family for effect in fit.hypothesis.effects]
    # an armature is a mass, and a position that no force depends on shows no offset
    assert added == ["viscous_friction", "coulomb_friction", "linear_spring", DELAY]


@pytest.mark.parametrize(("name", "package"), [("sysid_joints", "absl"), ("cma", "cma")])
def test_tuning_finds_the_friction_that_it_knows(cart: Study, name: str, package: str) -> None:
    pytest.importorskip(package, reason="pip install '.[bench]'")
    if name != "cma":
        pytest.importorskip("mujoco", reason="pip install '.[bench]'")
    model = method(name).fit(cart)
    found = model.joints["rail"]
    assert model.numbers["M"] == pytest.approx(MASS, rel=0.05)
    assert found["damping"] == pytest.approx(VISCOUS, rel=0.1)
    assert found["frictionloss"] == pytest.approx(DRY, rel=0.15)
    assert gap_of(model, cart) < 0.02


@pytest.mark.long
@pytest.mark.parametrize(("name", "package"), [("pysindy", "pysindy"), ("pyoperon", "pyoperon")])
def test_regression_writes_a_law_that_predicts(
    cart: Study, name: str, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip(package, reason="pip install '.[bench]'")
    monkeypatch.setattr("benchmarks.head_to_head.operon.GENERATIONS", 10)
    model = method(name).fit(cart)
    before = um.simulate(cart.system, cart.logs, cart.horizon).value
    assert "rail" in model.laws
    assert gap_of(model, cart) < 0.2 * before


def test_a_method_without_its_package_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(METHODS, "cma", ("cma_es", "CmaEs", ("no_such_package",)))
    with pytest.raises(ModuleNotFoundError, match="no_such_package is not installed: pip install"):
        method("cma")


def made_up(case: str, name: str, gap: float, **more: object) -> dict[str, object]:
    row = {"case": case, "method": name, "gap": gap, "learned": gap, "known": 0.4, "floor": 0.01}
    row |= {"cpu": 3.0, "wall": 4.0, "horizon": 0.1, "held_out": ["a", "b"], "says": "a | b", "error": ""}
    return {**row, "budget": "", "versions": {"cma": "4.5.0"}, "revision": "0", **more}


def test_an_effect_hides_where_the_gap_closes_and_a_parameter_is_wrong() -> None:
    drift = {"family": "drift", "channel": "joint"}
    truth = {"parameters": {"J": {"true": 2.0, "given": 2.4}}, "effects": [drift]}
    wrong, right = compared(truth, {"J": 2.5}), compared(truth, {"J": 2.02})
    assert wrong["parameter_errors"] == {"J": pytest.approx(0.25)}
    assert wrong["given_errors"] == {"J": pytest.approx(0.2)}
    fitted = {"named": [["coulomb_friction", "joint"]], "alike": [], "at_bound": []}
    found = page.virtual_table(
        [
            made_up("virtual/1", "cma", 0.05, **fitted, **wrong),
            made_up("virtual/2", "cma", 0.05, **fitted, **right),
            made_up("virtual/3", "cma", 0.39, **fitted, **wrong),
            made_up("virtual/4", "cma", 0.05, **{**fitted, "named": [["drift", "joint"]]}, **wrong),
            made_up("virtual/5", "cma", 0.05, **{**fitted, "at_bound": ["J"]}, **wrong),
            made_up("virtual/6", "ours", 0.02, **{**fitted, "alike": [["drift", "joint"]]}, **right),
        ]
    )
    assert found["hides"].tolist() == [True, False, False, False, False, None]
    assert found["named"].tolist() == [None, None, None, None, None, True]
    assert "| CMA-ES (PACE) | 5 | 4 | 1 | 25 % |" in page.counts(found)


def test_the_smallest_gap_is_bold_and_a_failure_is_named() -> None:
    failed = {**made_up("cart/friction", "pysindy", float("nan")), "error": "ValueError: too short"}
    found = page.measured_table(
        [made_up("cart/friction", "cma", 0.3), made_up("cart/friction", "ours", 0.1), failed]
    )
    assert "| cart/friction | 0.4 | 0.01 | – | – | – | 0.3 | failed | – | **0.1** |" in page.gaps(found)
    assert "ValueError: too short" in page.sayings(found)


def test_rows_are_read_in_the_order_of_their_names(tmp_path: Path) -> None:
    for name in ("b", "a"):
        (tmp_path / f"{name}.json").write_text(json.dumps({"case": name}))
    assert [row["case"] for row in rows(tmp_path)] == ["a", "b"]


def test_the_tables_of_the_page_are_those_of_its_files() -> None:
    text = (page.PAGE / "README.md").read_text(encoding="utf-8")
    assert {name for name in page.TABLES if f"<!-- table: {name} -->" in text} == {*page.TABLES}
    assert page.filled(text, page.PAGE) == text
