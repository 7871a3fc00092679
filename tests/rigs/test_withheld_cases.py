"""Cases of the withheld check: how they are drawn, and what is written of them."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.rigs.withheld.campaign import SYSTEMS, WithheldCampaign, write
from pipeline.rigs.withheld.carriages import Hoist
from pipeline.rigs.withheld.cases import Case, Planted
from pipeline.rigs.withheld.drawing import FAMILIES, cases
from pipeline.rigs.withheld.effects.effect import Only
from pipeline.rigs.withheld.experiments import run
from pipeline.rigs.withheld.machine import Machine
from pipeline.rigs.withheld.machines import BALANCES, EVERY, FURTHER, MACHINES
from tests.conftest import files_of
from tests.rigs.test_withheld import bare, short
from unmodelled.base.errors import BadInput
from unmodelled.base.markers import MARKER
from unmodelled.effects.library import effects
from unmodelled.systems.reader import read_system

#: Families that no machine plants: any loss, and inputs that a file does not use.
UNPLANTED = frozenset(
    (
        "nonlinear_loss",
        "input_dependence",
        "parameter_change",
        "parameter_error",
        "actuator_curve",
        "cyclic_error",
        "actuator_stiction",
    )
)
KINDS = ("single", "pair", "null", "outside", "local")


def test_an_effect_at_one_level_leaves_the_other_runs_alone() -> None:
    for planted, column in (
        (Planted("coulomb_friction", "rail", "m", 1.5), 1.5),
        (Planted("coulomb_friction", "rail"), None),
    ):
        case = Case("hoist", (planted,), 1.0, 5)
        plan = short(case, 0.5)
        off = np.max(np.abs(run(case, plan).exact["x"] - run(bare(Hoist()), plan).exact["x"]), axis=0)
        changed = plan.conditions["m"] == column if column else np.full(plan.runs, True)
        assert np.all((off > 1e-5) == changed)
    grouped = Case("belt_axis", (Planted("coulomb_friction", "rail", "group", "A"),), 1.0, 5)
    plan = grouped.plan()
    ((_, only),) = grouped.built(plan)
    assert isinstance(only, Only)
    assert only.where.tolist() == [float(group == "A") for group in plan.groups]


@pytest.mark.parametrize(("system", "command"), [("hoist", "u"), ("belt_axis", "i")])
def test_the_truth_lies_beside_what_a_user_hands_over(system: str, command: str, tmp_path: Path) -> None:
    effects = Planted("coulomb_friction", "rail"), Planted("actuator_offset", f"actuator:{command}")
    case = Case(system, effects, 2.0, 8)
    truth = write(case, tmp_path / "case", short(case, 0.3))
    names = sorted(p.name for p in (tmp_path / "case").iterdir())
    assert names == [MARKER, "logs", "system.yaml", "truth.json"]
    assert json.loads((tmp_path / "case" / "truth.json").read_text()) == truth
    assert [effect["family"] for effect in truth["effects"]] == ["coulomb_friction", "actuator_offset"]
    assert truth["effects"][0]["parameters"]["force"] > 8.0
    for name, content in files_of(tmp_path / "case").items():
        if name not in ("truth.json", MARKER):
            own = r"logs/run\d+\.(csv|parquet)|system.yaml|logs/experiments.csv|logs/provenance.json"
            assert re.fullmatch(own, name)
            assert not re.search(b"coulomb|offset|truth|planted", content.lower()), name
    header = (tmp_path / "case" / "logs" / "experiments.csv").read_text().split("\n")[0]
    assert header == ("id,file,m" if system == "hoist" else "id,file,group")


@pytest.mark.parametrize("machine", EVERY, ids=lambda machine: machine.name)
def test_uncertain_parameters_are_wrong_within_their_bounds(machine: Machine, tmp_path: Path) -> None:
    known = yaml.safe_load((SYSTEMS / f"{machine.name}.yaml").read_text())["parameters"]
    for seed in (1, 2):
        case = bare(machine, seed)
        truth = write(case, tmp_path / "case", short(case, 0.1))
        assert truth["verdict"] == "no_gap"
        given = yaml.safe_load((tmp_path / "case" / "system.yaml").read_text())
        assert tuple(given["outputs"]) == case.logged
        assert 1 <= len(truth["parameters"]) <= 3
        for name, parameter in given["parameters"].items():
            if name in truth["parameters"]:
                low, high = parameter["bounds"]
                assert low < parameter["value"] < high
                assert 0.045 < abs(parameter["value"] / known[name]["value"] - 1.0) < 0.305
                both = {"true": known[name]["value"], "given": parameter["value"]}
                assert truth["parameters"][name] == both
            else:
                assert parameter == known[name]


def test_same_case_same_bytes_other_seed_other_logs(tmp_path: Path) -> None:
    case = Case("pendulum", (Planted("scatter", "joint"),), 1.0, 6)
    for name, seed in (("one", 6), ("two", 6), ("other", 7)):
        write(replace(case, seed=seed), tmp_path / name, short(case, 0.3))
    one, two, other = (files_of(tmp_path / name) for name in ("one", "two", "other"))
    assert len(one) > 8 and one == two
    assert one["system.yaml"] != other["system.yaml"]


@pytest.mark.parametrize("kind", KINDS)
def test_cases_are_reproducible_and_of_their_kind(kind: str) -> None:
    drawn = cases(kind, 3)
    assert drawn == cases(kind, 3)
    assert drawn != cases(kind, 4)
    every = {case.system for case in drawn} == {machine.name for machine in MACHINES}
    assert every or kind in ("outside", "local")
    assert all(0.3 <= case.level <= 3.0 for case in drawn)
    assert {case.level for case in cases(kind, 3, level=0.7)} == {0.7}
    for case in drawn:
        families = [planted.family for planted in case.effects]
        assert len(set(families)) == {"pair": 2, "null": 0}.get(kind, 1)
        assert all((family in FAMILIES) != (kind == "outside") for family in families)
        assert all((planted.factor is not None) == (kind == "local") for planted in case.effects)


def test_every_family_of_the_library_is_planted_or_listed_as_not_planted() -> None:
    hint = (
        "plant the new family in a machine of pipeline/rigs/withheld, with a law of its own, and add its "
        "name to FAMILIES of drawing.py there; or add its name to UNPLANTED above"
    )
    library = {effect.family for effect in effects()}
    assert library >= FAMILIES, "a family of drawing.py is not in unmodelled/effects"
    assert library - FAMILIES == UNPLANTED, hint
    singles = cases("single", 0), cases("single", 0, machines=BALANCES)
    assert {case.effects[0].family for drawn in singles for case in drawn} == FAMILIES
    outside = {case.effects[0].family for case in cases("outside", 0)}
    assert len(outside) >= 6
    assert {one.family for machine in FURTHER for one in machine.plantable} <= FAMILIES | outside


@pytest.mark.parametrize("machine", FURTHER, ids=lambda machine: machine.name)
def test_the_library_has_every_planted_family_at_its_place(machine: Machine) -> None:
    system = read_system(SYSTEMS / f"{machine.name}.yaml")
    places = {(e.family, place) for e in effects() for place in e.places(system)}
    offered = {(family, p.name if p.kind == "port" else f"{p.kind}:{p.name}") for family, p in places}
    planted = {(one.family, one.channel) for one in machine.plantable if one.family in FAMILIES}
    # a drive that fades is a drift of its constant, which is a parameter
    assert planted - offered <= {("drift", f"actuator:{machine.input}")}


def test_local_effects_name_factors_and_groups_that_exist() -> None:
    for case in cases("local", 0):
        (planted,), machine = case.effects, case.machine
        levels = machine.groups if planted.factor == "group" else machine.factors[str(planted.factor)]
        assert planted.at in levels
        ((_, only),) = case.built(case.plan())
        assert isinstance(only, Only)
        assert 0.0 < np.mean(only.where) < 1.0


def test_a_campaign_writes_its_cases(tmp_path: Path) -> None:
    campaign = WithheldCampaign("null", 2, 4)
    provenance = campaign.write(tmp_path / "raw", 1)
    assert provenance["data"] == "virtual"
    assert provenance["experiments"] == 2
    folders = sorted(p.name for p in (tmp_path / "raw").iterdir() if p.is_dir())
    assert folders == ["null_001", "null_002"]
    truth = json.loads((tmp_path / "raw" / "null_002" / "truth.json").read_text())
    assert truth["system"] == cases("null", 4)[1].system
    assert truth["seed"] == cases("null", 4)[1].seed + 1


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: cases("triple", 0), "kind: 'triple' is not one of single"),
        (lambda: WithheldCampaign("null", 0), r"source.count: must be 1 to \d+"),
        (lambda: WithheldCampaign("nil"), "kind"),
        (lambda: Case("crane", (), 1.0, 0).machine, "system: 'crane' is not one of slider_crank"),
        (lambda: Case("hoist", (Planted("backlash", "drum"),), 1.0, 0), "hoist has no backlash at drum"),
        (lambda: Case("hoist", (), -1.0, 0), "level: must not be negative"),
    ],
)
def test_what_cannot_be_planted_is_refused(make: Any, words: str) -> None:
    with pytest.raises(BadInput, match=words):
        make()
