"""The rules of the withheld check on made-up diagnoses, and the numbers that are made of them."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from pipeline.withheld import scores as scored
from pipeline.withheld.answers import judged
from pipeline.withheld.channels import parameter_channels
from pipeline.withheld.folders import campaigns_in, cases_in
from tests.evaluation.withheld_cases import ACTS_AT, Content, diagnosis, effect, refit, truth
from unmodelled.base.errors import BadInput
from unmodelled.systems.reader import read_system

SYSTEMS = Path(__file__).parents[2] / "systems" / "withheld"
COULOMB, DRAG, LAG = ("coulomb_friction", "rail"), ("quadratic_drag", "rail"), ("actuator_lag", "actuator:u")
NO_GAP = diagnosis(verdict="no_gap")
UNKNOWN = diagnosis(verdict="unknown")


def row(real: Content, said: Content, *seen: bool, **more: Any) -> dict[str, Any]:
    return judged(real, said, refit(*seen, **more), ACTS_AT)


@pytest.mark.parametrize(
    ("said", "right", "first", "in_set", "channel"),
    [
        (diagnosis(effect(*COULOMB)), True, True, True, True),
        (diagnosis(effect(*DRAG, COULOMB)), True, False, True, True),
        (diagnosis(effect(*DRAG)), False, False, False, True),
        (diagnosis(effect(*LAG)), False, False, False, False),
        (diagnosis(effect("coulomb_friction", "motor")), False, False, False, False),
        (diagnosis(effect(*COULOMB), effect(*LAG)), False, True, True, True),
        (diagnosis(effect(*LAG), effect(*COULOMB)), False, False, True, False),
        (diagnosis(effect(*COULOMB, factor="m", level=1.5)), False, True, True, True),
        (NO_GAP, False, False, False, False),
        (UNKNOWN, False, False, False, True),
        (diagnosis(verdict="unknown", where="motor"), False, False, False, False),
        (diagnosis(effect(*COULOMB), verdict="unknown"), False, False, False, True),
    ],
)
def test_a_single_effect(said: Content, right: bool, first: bool, in_set: bool, channel: bool) -> None:
    found = row(truth(COULOMB), said, True)
    assert (found["right"], found["first"]) == (right, first)
    assert (found["all_reported"], found["channel"]) == (in_set, channel)


def test_what_logs_cannot_tell_from_it_is_right_too() -> None:
    offset = ("constant_load", "rail")
    real = truth(("actuator_offset", "actuator:u"), alike=(offset,))
    found = row(real, diagnosis(effect(*offset)), True)
    assert found["right"] and found["first"] and found["exact"] and found["channel"]
    assert found["set_size"] == 1
    assert row(real, diagnosis(effect(*offset, COULOMB, DRAG)), True)["set_size"] == 3
    assert row(real, diagnosis(effect(*offset, COULOMB), effect(*LAG, DRAG)), True)["set_size"] == 2


def test_a_parameter_is_where_it_acts() -> None:
    real = truth(("drift", "rail"))
    assert row(real, diagnosis(effect("drift", "parameter:b")), True)["right"]
    elsewhere = row(real, diagnosis(effect("drift", "parameter:M")), True)
    assert not elsewhere["right"] and not elsewhere["channel"]


def test_an_effect_that_nobody_can_see_need_not_be_found() -> None:
    assert row(truth(COULOMB), NO_GAP, False)["right"]
    assert row(truth(COULOMB), diagnosis(effect(*COULOMB)), False)["right"]
    assert not row(truth(COULOMB), diagnosis(effect(*LAG)), False)["right"]
    assert not row(truth(COULOMB), NO_GAP, False)["seen"]


def test_nothing_planted() -> None:
    nothing = truth(verdict="no_gap")
    assert row(nothing, NO_GAP)["right"]
    assert not row(nothing, UNKNOWN)["right"]
    assert not row(nothing, diagnosis(effect(*COULOMB)))["right"]
    assert row(nothing, NO_GAP)["seen"] and row(nothing, NO_GAP)["sparse_first"]
    assert not row(nothing, NO_GAP, term=COULOMB)["sparse_first"]


@pytest.mark.parametrize(
    ("said", "right", "exact", "one"),
    [
        ((effect(*LAG), effect(*COULOMB)), True, True, True),
        ((effect(*LAG), effect(*DRAG, COULOMB)), True, False, True),
        ((effect(*COULOMB),), False, False, True),
        ((effect(*COULOMB), effect(*COULOMB)), False, False, True),
        ((effect(*COULOMB), effect(*LAG), effect(*DRAG)), False, False, True),
        ((effect(*DRAG), effect("backlash", "rail")), False, False, False),
    ],
)
def test_a_pair(said: tuple[Content, ...], right: bool, exact: bool, one: bool) -> None:
    found = row(truth(COULOMB, LAG), diagnosis(*said), True, True)
    assert (found["right"], found["exact"], found["one"]) == (right, exact, one)


def test_of_a_pair_only_what_can_be_seen_is_asked_for() -> None:
    real = truth(COULOMB, LAG)
    assert row(real, diagnosis(effect(*COULOMB)), True, False)["right"]
    assert not row(real, diagnosis(effect(*LAG)), True, False)["right"]
    assert not row(real, diagnosis(effect(*COULOMB)), True, False)["seen"]


def test_an_effect_in_some_of_the_runs() -> None:
    real = truth(COULOMB, factor="m", level=1.5)
    here = row(real, diagnosis(effect(*COULOMB, factor="m", level=1.5)), True)
    assert here["right"] and here["placed"] and "where m is 1.5" in here["truth"]
    everywhere = row(real, diagnosis(effect(*COULOMB)), True)
    assert everywhere["first"] and not everywhere["placed"] and not everywhere["right"]


def test_an_effect_of_no_family() -> None:
    real = truth(("sticky_valve", "actuator:u"), verdict="unknown", alike=(LAG,))
    assert row(real, diagnosis(verdict="unknown", where="rail"), False)["right"]
    assert row(real, diagnosis(effect(*LAG)), False)["right"]
    assert not row(real, diagnosis(effect(*COULOMB)), False)["right"]
    assert not row(real, NO_GAP, False)["right"]
    assert row(real, NO_GAP, False, gap_seen=False)["right"]
    assert row(real, diagnosis(effect(*LAG), verdict="main_effect"), False)["right"]
    unnamed = row(real, diagnosis(verdict="unknown", where="actuator:u"), False)
    assert unnamed["right"] and unnamed["channel"] and unnamed["seen"] and not unnamed["first"]


def table() -> pd.DataFrame:
    """Ten cases: five single ones, one of which nobody can see, a pair, two nulls and two outside."""
    outside = truth(("sticky_valve", "actuator:u"), verdict="unknown")
    either = diagnosis(effect(*DRAG, COULOMB), confidence=0.95, shrink=0.45)
    cases = [
        ("single", row(truth(COULOMB), diagnosis(effect(*COULOMB), confidence=0.95), True, term=COULOMB)),
        ("single", row(truth(COULOMB), either, True)),
        ("single", row(truth(DRAG), diagnosis(effect(*LAG), confidence=0.95, shrink=0.0), True)),
        ("single", row(truth(LAG) | {"system": "belt_axis"}, UNKNOWN, True)),
        ("single", row(truth(LAG) | {"level": 0.31}, diagnosis(effect(*LAG)), False)),
        ("pair", row(truth(COULOMB, LAG), diagnosis(effect(*LAG), effect(*COULOMB)), True, True)),
        ("null", row(truth(verdict="no_gap"), diagnosis(verdict="no_gap", confidence=1.0))),
        ("null", row(truth(verdict="no_gap"), diagnosis(effect(*LAG), confidence=0.2))),
        ("outside", row(outside, UNKNOWN, False)),
        ("outside", row(outside, diagnosis(effect(*COULOMB), confidence=0.85), False)),
    ]
    rows = [
        {"kind": kind, "case": f"{kind}_{k}", **case, "seconds": 10.0 + k, "memory": 500.0 + k}
        for k, (kind, case) in enumerate(cases)
    ]
    return pd.DataFrame(rows)


def test_scores_count_what_can_be_seen() -> None:
    found = scored.scores(table())
    single = found["single"]
    assert (single["top1"]["value"], single["top1"]["n"]) == (0.25, 4)
    assert single["in_set"]["value"] == 0.5 and single["channel"]["value"] == 0.5
    assert single["seen"]["value"] == 0.8
    assert (single["set_size"]["value"], single["set_size"]["n"]) == (pytest.approx(4.0 / 3.0), 3)
    assert found["pair"]["exact"]["value"] == found["pair"]["one"]["value"] == 1.0
    assert found["null"]["correct"]["value"] == 0.5
    assert found["outside"]["flagged"]["value"] == 0.5 and found["outside"]["wrong"]["value"] == 0.5
    assert found["sparse_regression"]["single"]["top1"]["value"] == 0.25
    assert "local" not in found
    low, high = single["top1"]["interval"]
    assert 0.0 < low < 0.25 < high < 0.9


def test_shrink_is_compared_with_the_oracles() -> None:
    found = scored.scores(table())
    own = [0.8, 0.45, 0.0, 0.8, 0.8]
    assert found["shrink_of_oracle"]["value"] == pytest.approx(sum(own) / 0.9 / 5)
    network = (0.5**2 - 0.2**2) / (0.5**2 - 0.1**2)
    assert found["network"]["shrink_of_oracle"]["value"] == pytest.approx(network / 0.9)


def test_confidence_is_compared_with_how_often_it_is_right() -> None:
    cases = table()
    # 0.85: 0 of 1; 0.2: 0 of 1; 0.9 to 1.0: all but two of eight
    binned = scored.calibration(cases)
    assert binned["cases"].tolist() == [1, 1, 8]
    assert binned["right"].tolist() == [0.0, 0.0, 0.75]
    top = (3 * 0.95 + 4 * 0.9 + 1.0 - 6.0) / 10
    assert scored.scores(cases)["calibration_error"]["value"] == pytest.approx(0.02 + 0.085 + top)


def test_tables_of_figures() -> None:
    cases = table()
    confusion = scored.confusion(cases).set_index(["family", "first_family"])["cases"].to_dict()
    assert confusion == {
        ("coulomb_friction", "coulomb_friction"): 1,
        ("coulomb_friction", "quadratic_drag"): 1,
        ("quadratic_drag", "actuator_lag"): 1,
        ("actuator_lag", "unknown"): 1,
    }
    detection = scored.detection(cases)
    low = detection[detection["from"] < 0.35].set_index("what")["share"].to_dict()
    assert low == {"oracle": 0.0, "in_set": 1.0, "top1": 1.0, "sparse_regression": 0.0}
    assert set(detection["cases"]) == {1, 4}
    missed = scored.misses(cases)
    assert missed["case"].tolist() == ["single_2", "single_3", "outside_9", "null_7"]
    listed = scored.listed(cases).set_index("measure")
    assert listed.loc["single.top1", "value"] == 0.25 and listed.loc["single.top1", "belt_axis"] == 0.0
    assert pd.isna(listed.loc["pair.exact", "belt_axis"]) and listed.loc["pair.exact", "hoist"] == 1.0


def test_where_parameters_act() -> None:
    files = (SYSTEMS / f"{name}.yaml" for name in ("hoist", "belt_axis"))
    hoist, axis = (parameter_channels(read_system(file)) for file in files)
    acting = {"M": frozenset(), "kf": {"actuator:u"}, "b": {"rail"}, "g": {"rail"}}
    assert hoist == {f"parameter:{name}": channels for name, channels in acting.items()}
    assert axis["parameter:b_m"] == {"motor"} and not axis["parameter:k_b"]


def test_an_empty_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"holds no withheld case, a folder with system\.yaml"):
        cases_in(tmp_path)
    with pytest.raises(BadInput, match="holds no campaign"):
        campaigns_in(tmp_path / "nowhere")


def test_campaigns_are_found_in_a_folder_and_in_its_parts(tmp_path: Path) -> None:
    found = [tmp_path / name for name in ("2000/null", "2000/single", "pair")]
    for folder in (*found, tmp_path / ".growing/null"):
        (folder / "case_001/logs").mkdir(parents=True)
        for holding in (folder, folder / "case_001/logs"):  # measurements have an origin of their own
            (holding / "provenance.json").write_text("{}")
    assert campaigns_in(tmp_path) == found


def test_a_part_of_the_measurement_chain_is_no_false_alarm_and_no_answer() -> None:
    chain = {"tolerated": [{"family": LAG[0], "channel": LAG[1]}]}
    nothing = truth(verdict="no_gap") | chain
    assert row(nothing, diagnosis(effect(*LAG)))["right"]
    assert not row(nothing, diagnosis(effect(*LAG), effect(*DRAG)))["right"]
    assert row(truth(COULOMB) | chain, diagnosis(effect(*LAG), effect(*COULOMB)), True)["first"]
    assert not row(truth(COULOMB) | chain, diagnosis(effect(*LAG)), True)["right"]


def test_a_check_of_the_logs_is_right_about_the_measurement_chain_alone() -> None:
    chain = {"tolerated": [{"family": "sensor_delay", "channel": "sensor:v"}]}
    late, shifted = ({"logs": [{"channel": name, "problem": "copy"}]} for name in ("v", "x"))
    asked = diagnosis(verdict="check_logs")
    assert row(truth(verdict="no_gap") | chain, asked | late)["right"]
    assert not row(truth(verdict="no_gap") | chain, asked | shifted)["right"]
    assert not row(truth(COULOMB) | chain, asked | late, True)["right"]


def test_a_main_effect_is_the_largest_of_the_planted() -> None:
    real = truth(COULOMB, LAG)
    real["effects"][0] |= {"share": 0.8, "material": True}
    real["effects"][1] |= {"share": 0.05, "material": False}
    found = row(real, diagnosis(effect(*COULOMB), verdict="main_effect"), True, True)
    assert found["right"] and found["first"] and (found["material"], found["material_named"]) == (1, 1)
    assert not row(real, diagnosis(effect(*LAG), verdict="main_effect"), True, True)["right"]
    assert not row(real, diagnosis(effect(*COULOMB)), True, True)["right"]


def test_harm_and_coverage_are_counted() -> None:
    real = truth(COULOMB) | {
        "parameters": {"b": {"true": 31.0, "given": 28.0}, "M": {"true": 8.5, "given": 9.0}}
    }
    said = diagnosis(effect(*COULOMB)) | {
        "parameters": {"b": {"interval": [30.0, 32.0]}, "M": {"interval": [8.6, 9.0]}}
    }
    rows = []
    for augmented in (0.1, 0.5):
        errors = {"reidentified": 0.4, "augmented": augmented}
        rows.append(judged(real, said, refit(True), ACTS_AT, errors))
    assert [found["harmful"] for found in rows] == [False, True]
    assert (rows[0]["intervals"], rows[0]["covered"]) == (2, 1)
    cases = pd.DataFrame([{"kind": "single", "case": "a", **r, "seconds": 1.0, "memory": 1.0} for r in rows])
    found = scored.scores(cases)
    assert found["harmful"]["value"] == 0.5 and found["coverage"]["effect"]["value"] == 0.5
    assert found["material"]["named"]["value"] == 1.0 and found["calibration"]["effect"]["n"] == 2
