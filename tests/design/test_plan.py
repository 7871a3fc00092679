"""Planned experiments: sizes that show, what looks alike, and the best experiment that was seen."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import Array, system_of, text_of
from unmodelled.api.plan import Plan, plan
from unmodelled.base.errors import BadInput
from unmodelled.cli.verbs.plan import plan as plan_verb
from unmodelled.design.criterion import Criterion
from unmodelled.design.design import best_experiment
from unmodelled.design.limits import Limits, Range, read_limits
from unmodelled.design.planned import simulated_logs
from unmodelled.design.signals import references
from unmodelled.design.visible import DISTANCE
from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.systems.reader import read_system

ROOT = Path(__file__).parents[2]
MASS, NOISE, PERIOD, DURATION = 2.0, 1e-3, 0.02, 4.0
SYSTEM = text_of("cart.yaml")
LIMITS = f"""
duration: {DURATION}
period: {PERIOD}
inputs: {{force: {{low: -1.5, high: 2, rate: 20}}}}
travel: {{x: {{low: -1, high: 1}}}}
noise: {{x: {NOISE}, v: {NOISE}}}
"""


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """System, limits, and two planned experiments: forward motion only, and motion to and fro."""
    folder = tmp_path_factory.mktemp("cart")
    system_of(SYSTEM, folder)
    (folder / "limits.yaml").write_text(LIMITS)
    t = PERIOD * np.arange(round(DURATION / PERIOD) + 1)
    forces = {"forward": 1.0 + 0.4 * np.sin(3.0 * t), "to_and_fro": 1.5 * np.cos(2.5 * t)}
    for name, force in forces.items():
        pd.DataFrame({"t": t, "force": force}).to_csv(folder / f"{name}.csv", index=False)
    return folder


def planned(case: Path, inputs: str | None = None, system: str = SYSTEM, limits: str = LIMITS) -> Plan:
    (case / "other_limits.yaml").write_text(limits)
    given = None if inputs is None else case / f"{inputs}.csv"
    return plan(system_of(system, case / "other"), case / "other_limits.yaml", given)


@pytest.fixture(scope="module")
def to_and_fro(case: Path) -> Plan:
    return planned(case, "to_and_fro")


def sizes(found: Plan) -> dict[str, float]:
    return dict(zip(found.table()["effect"], found.table()["size"], strict=True))


def looks_like(found: Plan, effect: str) -> str:
    return str(found.table().set_index("effect").loc[effect, "looks_like"])


def test_the_size_of_a_load_is_that_of_textbook_least_squares(case: Path) -> None:
    """Without damping, a load F moves a cart by F t²/(2 m); its start is known within the noise."""
    found = planned(case, "to_and_fro", SYSTEM.replace("0.5, unit", "0, unit"))
    logs = simulated_logs(found.inputs, found.system, found.limits, 0)
    steps = round(default_horizon(logs) / PERIOD)
    t = PERIOD * np.arange(1, steps + 1)
    load = np.concatenate([t**2 / (2.0 * MASS), t / MASS]) / NOISE
    start = np.stack([np.concatenate(c) for c in ((1.0 + 0.0 * t, 0.0 * t), (t, 1.0 + 0.0 * t))], axis=1)
    covariance = np.eye(2 * steps) + start @ start.T  # of errors and starts, in units of the noise
    windows = (len(logs.t) - 1) // steps
    information = windows * load @ np.linalg.solve(covariance, load)
    assert sizes(found)["constant load at rail"] == pytest.approx(DISTANCE / np.sqrt(information), rel=0.1)


def test_sizes_are_in_proportion_to_the_noise(case: Path, to_and_fro: Plan) -> None:
    limits = LIMITS.replace(f"x: {NOISE}, v: {NOISE}", f"x: {NOISE / 4}, v: {NOISE / 4}")
    finer = sizes(planned(case, "to_and_fro", limits=limits))
    for effect in ("Coulomb friction at rail", "constant load at rail"):
        assert finer[effect] == pytest.approx(sizes(to_and_fro)[effect] / 4.0, rel=0.1)


def test_a_machine_without_inputs_has_no_experiment_to_plan(case: Path) -> None:
    driven = SYSTEM.replace("inputs: {force: {unit: N}}\n", "").replace("force - ", "-")
    with pytest.raises(BadInput, match="has no inputs"):
        planned(case, system=driven)


def test_friction_and_a_load_look_alike_only_without_reversals(case: Path, to_and_fro: Plan) -> None:
    forward = planned(case, "forward", limits=LIMITS.replace("low: -1, high: 1", "low: -9, high: 9"))
    assert "constant load at rail" in looks_like(forward, "Coulomb friction at rail")
    assert "constant load at rail" not in looks_like(to_and_fro, "Coulomb friction at rail")
    for found in (forward, to_and_fro):  # these are the same force
        assert "actuator offset at input force" in looks_like(found, "constant load at rail")


def test_what_is_refitted_does_not_show(case: Path, to_and_fro: Plan) -> None:
    refitted = SYSTEM.replace("0.5, unit: N s/m", "0.5, unit: N s/m, identify: true, bounds: [0, 50]")
    effect = "viscous friction at rail"
    found = planned(case, "to_and_fro", refitted)
    assert found.content["refitted"] == ["b"]
    size = sizes(found)[effect]
    assert np.isnan(size) or size > 20.0 * sizes(to_and_fro)[effect]


def test_the_verb_plans_experiments_within_the_limits(
    case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "plan"
    plan_verb(case / "system.yaml", case / "limits.yaml", None, out)
    said = capsys.readouterr().out
    assert "shows from" in said and "Coulomb friction at rail" in said
    content = json.loads((out / "plan.json").read_text())
    table = pd.read_csv(out / "effects.csv")
    assert table["effect"].tolist() == [entry["label"] for entry in content["effects"]]
    files = sorted((out / "experiments").glob("*.csv"))
    assert len(files) == len(content["experiments"]) >= 8
    system = read_system(case / "system.yaml")
    limits = read_limits(case / "limits.yaml", system)
    for file in files:
        force = pd.read_csv(file)["force"]
        assert force.between(-1.5, 2.0).all() and force.diff().abs().max() <= 20.0 * PERIOD + 1e-6
    inputs = {file.stem: pd.read_csv(file)[["force"]].to_numpy() for file in files}
    logs = simulated_logs(inputs, system, limits, 1)
    assert np.abs(logs.y[:, 0]).max() <= 1.0 + 5.0 * NOISE


@pytest.mark.long
def test_the_page_shows_what_is_printed(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "diagnosis" / "README.md").read_text().partition("## Before any log exists")[2]
    blocks = re.findall(r"^```\w*\n(.*?)^```", page.partition("\n## ")[0], re.S | re.M)
    limits, _, shown = blocks
    (tmp_path / "limits.yaml").write_text(limits)
    said = repr(plan(read_system(ROOT / "systems" / "pendulum.yaml"), tmp_path / "limits.yaml"))
    rows = said.replace("\u202f", " ").replace("\xa0", " ").splitlines()
    assert set(shown.splitlines()) <= set(rows)
    assert f"of {len(rows) - 5} rows" in page


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (f"noise: {{x: {NOISE}, v: {NOISE}}}", "", "noise: the output x has none: add noise"),
        (f"noise: {{x: {NOISE}", "noise: {z: 1", "no 'z'"),
        (f"period: {PERIOD}", "", "has no period"),
        ("low: -1, high: 1", "low: 5, high: 6", "no experiment of 4 s was found"),
    ],
)
def test_bad_limits_are_one_line(case: Path, tmp_path: Path, old: str, new: str, message: str) -> None:
    limits = tmp_path / "limits.yaml"
    limits.write_text(LIMITS.replace(old, new))
    with pytest.raises(BadInput, match=message) as error:
        plan_verb(case / "system.yaml", limits, None, tmp_path / "out")
    assert "\n" not in str(error.value) and str(limits) in str(error.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,torque\n0,1\n1,1\n", "force"),
        ("t,force\n0,1\n0,1\n", "column t: does not increase"),
        ("t,force\n0,1\n1,x\n", "row 3"),
    ],
)
def test_bad_inputs_are_one_line(case: Path, tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "run.csv").write_text(text)
    with pytest.raises(BadInput, match=message):
        plan_verb(case / "system.yaml", case / "limits.yaml", tmp_path / "run.csv", tmp_path / "out")
    with pytest.raises(BadInput, match="holds no CSV file"):
        (tmp_path / "empty").mkdir()
        plan_verb(case / "system.yaml", case / "limits.yaml", tmp_path / "empty", tmp_path / "out")


WRITTEN = (Range(-3.0, 5.0, 400.0), Range(-1.0, 1.0))
BOX = Limits(Path("limits.yaml"), 2.0, 0.02, WRITTEN, WRITTEN, {}, {}, {}, {})


@dataclass(frozen=True)
class Needle:
    """A criterion that one experiment alone meets, so that no search finds it by chance."""

    target: Array
    limits: Limits = BOX

    def __call__(self, u: Array) -> Array:
        return u

    def scores(self, u: Array) -> Array:
        return np.asarray(np.where(np.abs(u - self.target).max(axis=(1, 2)) < 1e-9, 1.0, 0.1))

    def worth(self, u: Array) -> float:
        return float(self.scores(u[None])[0])


@pytest.mark.parametrize("amplitude", [0, 5])
@pytest.mark.parametrize("reference", ["chirp", "random"])
def test_no_proposal_is_worth_less_than_what_it_is_compared_with(
    reference: str, amplitude: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("unmodelled.design.design.GENERATIONS", 1)
    monkeypatch.setattr("unmodelled.design.design.REFINED", 1)
    target = references(BOX, 4)[reference][amplitude]
    found = best_experiment(cast(Criterion, cast(Any, Needle(target))), 4, lambda _: None)
    assert found.score == 1.0
    np.testing.assert_allclose(found.u, target, atol=1e-9)
