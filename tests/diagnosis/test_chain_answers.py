"""What a comparison of laws by evidence adds to an answer, in diagnosis.json and in lines."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import unmodelled as um
from tests.diagnosis.chain_answers import NAN, THETA, by_evidence
from tests.diagnosis.diagnoses import FRICTION, diagnosis, known
from tests.diagnosis.studies import JOINT, TORQUE, effect, scales_of
from tests.diagnosis.test_summary import WHERE
from unmodelled.base.answers import check_content, read_diagnosis
from unmodelled.base.files import write_json
from unmodelled.base.kind_words import kind_sentence, ranking
from unmodelled.design.checked import check_answer
from unmodelled.design.rivals import place_of
from unmodelled.diagnosis.answer.chain_sentences import (
    chain_entry,
    chain_explains,
    chain_sentence,
    small_gap,
    without_common_delay,
)
from unmodelled.diagnosis.answer.sentences import sentences
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.result import ChainPart, Diagnosis
from unmodelled.effects.place import Place
from unmodelled.logs.logs import Logs
from unmodelled.report.headline import headline
from unmodelled.systems.model import System

B = Place("parameter", "b")


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> tuple[System, Logs]:
    """The pendulum, whose angle is logged in degrees."""
    degrees = "  theta: {unit: rad}\nparameters:", "  theta: {unit: deg}\nparameters:"
    return known(tmp_path_factory.mktemp("degrees"), degrees)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    return by_evidence(diagnosis(tmp_path_factory.mktemp("friction"), FRICTION))


@pytest.fixture(scope="module")
def content(found: Diagnosis, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """As it is read from the file, which keeps to the schema."""
    path = tmp_path_factory.mktemp("json") / "diagnosis.json"
    write_json(path, summary(found, WHERE))
    json.loads(path.read_text(), parse_constant=pytest.fail)
    return read_diagnosis(path)


@pytest.mark.parametrize(
    ("family", "variant", "place", "value", "unit", "expected"),
    [
        ("sensor_delay", "", THETA, 0.008, "s", "theta is 8 ms late"),
        ("sensor_delay", "", THETA, -0.008, "s", "theta is 8 ms early"),
        ("input_delay", "", TORQUE, 0.012, "s", "torque acts 12 ms late"),
        ("actuator_lag", "", TORQUE, 43.5, "s", "torque acts behind a lag of 44 s"),
        ("sensor_lag", "", THETA, 0.02, "s", "theta is shown behind a lag of 20 ms"),
        ("sensor_gain", "", THETA, 0.043, "1", "theta reads 4.3 % too much"),
        ("sensor_gain", "", THETA, -1.2, "1", "theta reads 120 % too little"),
        ("sensor_offset", "", THETA, -0.0052, "rad", "the zero of theta is 0.3 deg too low"),
        ("actuator_gain", "", TORQUE, 0.05, "1", "torque acts 5 % stronger than logged"),
        ("actuator_offset", "", TORQUE, -0.02, "N m", "torque acts 20 mN m lower than logged"),
        ("scatter", "gain", TORQUE, 0.11, "1", "the supply (gain of torque) varies by 11 % from run to run"),
        ("scatter", "", B, 0.06, "1", "the damping b varies by 6 % from run to run"),
        ("constant_load", "", JOINT, -0.02, "N m", "constant load at joint is −20 mN m"),
    ],
)
def test_a_sentence_for_every_kind_of_part(
    family: str,
    variant: str,
    place: Place,
    value: float,
    unit: str,
    expected: str,
    machine: tuple[System, Logs],
) -> None:
    system, logs = machine
    added = effect(family, variant).add(system, place, scales_of(system, logs))
    part = ChainPart(added, value, NAN, unit, bool(added.per_experiment))
    assert chain_sentence(part).replace("\xa0", " ") == expected


@pytest.mark.parametrize(("late", "left"), [(0.0062, []), (0.009, ["theta is 3 ms late"]), (-0.006, None)])
def test_a_delay_of_outputs_that_the_input_takes_back_is_not_told(
    late: float, left: list[str] | None, machine: tuple[System, Logs]
) -> None:
    """Input and output of a machine can be moved in time together; other delays stay as they are."""
    system, logs = machine
    parts = [
        ChainPart(effect(family, "").add(system, place, scales_of(system, logs)), value, 1e-6, "s", False)
        for family, place, value in (("input_delay", TORQUE, -0.006), ("sensor_delay", THETA, late))
    ]
    found = without_common_delay(parts)
    told = [chain_sentence(part).replace("\xa0", " ") for part in found]
    assert told == (["torque acts 6 ms early", "theta is 6 ms early"] if left is None else left)


def test_numbers_of_the_chain_are_si_and_shown_as_logged(machine: tuple[System, Logs]) -> None:
    system, logs = machine
    offset = effect("sensor_offset").add(system, THETA, scales_of(system, logs))
    entry = chain_entry(ChainPart(offset, 0.0174532925, 0.00174532925, "rad", False))
    assert (entry["channel"], entry["family"], entry["value"]) == (
        "sensor:theta",
        "sensor_offset",
        0.0174532925,
    )
    assert entry["shown"] == {"value": pytest.approx(1.0), "unit": "deg", "error": pytest.approx(0.1)}


def test_diagnosis_json_has_what_is_known_and_nothing_else(found: Diagnosis, content: dict[str, Any]) -> None:
    assert len(content["chain"]) == 7 and content["strangers"] == ["run1"]
    lag, varying = content["chain"][2], content["chain"][5]
    assert lag["error"] is None and varying["per_experiment"] and varying["variant"] == "gain"
    best, failed = content["evidence"][0], content["evidence"][-1]
    friction = {"family": "coulomb_friction", "port": "joint"}
    assert best == {**friction, "horizon": 0.1, "nats": 420.0, "removed": 0.98}
    assert failed["nats"] is None and failed["family"] == "quadratic_drag"
    (effect_,) = content["effects"]
    alike = effect_["indistinguishable"]
    assert [each["kind"] for each in (effect_, *alike)] == ["dry friction", "dry friction", "damping"]
    shares = [each["probability"] for each in (effect_, *alike)]
    assert shares == pytest.approx([0.72, 0.2208, 0.0192])
    bare = replace(found, chain=(), evidence=(), strangers=())
    assert not {"chain", "evidence", "strangers"} & set(summary(bare, WHERE))


def test_probabilities_add_up_to_the_confidence_of_the_effect(found: Diagnosis) -> None:
    (friction,) = found.effects
    halved = tuple(each / 2.0 for each in friction.probabilities)
    for given in (friction.probabilities, halved):
        told = summary(replace(found, effects=(replace(friction, probabilities=given),)), WHERE)
        (entry,) = told["effects"]
        total = sum(each["probability"] for each in (entry, *entry["indistinguishable"]))
        assert total == pytest.approx(entry["confidence"])


def test_the_plainest_law_is_named_where_another_kind_is_likelier(found: Diagnosis) -> None:
    (friction,) = found.effects
    swapped = replace(friction, added=friction.indistinguishable[1], estimates={})
    rest = (friction.added, friction.indistinguishable[0])
    others = replace(swapped, indistinguishable=rest, probabilities=(0.1, 0.6, 0.3), confidence=1.0)
    (entry,) = summary(replace(found, effects=(others,)), WHERE)["effects"]
    assert entry["kind"] == "damping"
    assert kind_sentence(entry).replace("\xa0", " ") == (
        "Form: viscous friction 10 %. Other kinds: Coulomb friction 60 %, hysteresis (Dahl) 30 %. These logs "
        "cannot tell them apart; viscous friction is named as the plainest."
    )


def test_the_lines_tell_kind_first_and_how_the_logs_were_made(content: dict[str, Any]) -> None:
    lines = [line.replace("\xa0", " ") for line in sentences(content)]
    kind, law = lines[1:3]
    assert kind.startswith(
        "- Dry friction at joint 94 %, damping at joint 2 %, something else 4 %. Form: Coulomb "
    )
    assert law.startswith("    Coulomb friction at joint: F_c*sign(omega) (explains ")
    assert "Experiment run1 does not follow this law: look at what was different there." in lines
    start = lines.index("how these logs were made:")
    assert lines[start + 1 : start + 3] == ["- theta is 8 ms late", "- torque acts 12 ms late"]
    bare = {name: entry for name, entry in content.items() if name not in ("chain", "evidence", "strangers")}
    text = "\n".join(sentences(bare))
    assert "how these logs" not in text and "does not follow" not in text


def test_the_title_has_the_probabilities_of_the_comparison(content: dict[str, Any]) -> None:
    (effect,) = content["effects"]
    alike, viscous = effect["indistinguishable"]
    spring = {"family": "linear_spring", "port": "joint", "kind": "elasticity"}
    shares = {
        "F": (effect, 0.72),
        "h": (alike, 0.1),
        "v": (viscous, 0.08),
        "k": (spring, 0.05),
        "0": (None, 0.01),
    }
    rows = [
        {
            "effects": [one] if one else [],
            "difference": 0.0,
            "score": 1.0,
            "standard_error": 0.0,
            "named": one is effect,
            "probability": share,
        }
        for one, share in shares.values()
    ]
    told = content | {"comparison": rows}
    ranked = dict(ranking(told, effect))
    assert ranked == pytest.approx(
        {
            "dry friction at joint": 0.82,
            "damping at joint": 0.08,
            "elasticity at joint": 0.05,
            "something else": 0.05,
        }
    )
    table = um.Answer(Path(), told).comparison
    friction = table.hypothesis.str.contains("Coulomb|hysteresis")
    assert table.probability[friction].sum() == pytest.approx(ranked["dry friction at joint"])
    assert (
        headline(told).replace("\xa0", " ").startswith("Dry friction at joint 82 %, damping at joint 8 %, ")
    )
    nothing = told | {"verdict": "unknown", "effects": [], "alike": spring}
    assert "; most alike: elasticity at joint, such as linear spring." in headline(nothing)


def test_python_tells_the_same(content: dict[str, Any], tmp_path: Path) -> None:
    answer = um.Answer(tmp_path, content)
    assert answer.chain[0].replace("\xa0", " ") == "theta is 8 ms late" and answer.strangers == ("run1",)
    assert (
        list(answer.evidence.columns) == ["law", "horizon", "nats", "removed"] and len(answer.evidence) == 13
    )
    (named,) = answer.effects
    assert (named.kind, named.probability) == ("dry friction", pytest.approx(0.72))
    assert repr(named).startswith("Dry friction at joint 94")


def test_the_next_experiment_takes_such_an_answer(found: Diagnosis, content: dict[str, Any]) -> None:
    assert not check_answer(found.system, found.logs, content)
    (named,) = content["effects"]
    assert [place_of(each) for each in (named, *named["indistinguishable"])] == [JOINT] * 3


@pytest.mark.parametrize(
    ("key", "damaged"),
    [
        ("chain", [{"channel": "sensor:theta"}]),
        ("evidence", [{"family": "drag", "port": "joint", "horizon": 0, "nats": 1, "removed": 1}]),
        ("strangers", [7]),
    ],
)
def test_damaged_entries_are_refused(key: str, damaged: list[Any], content: dict[str, Any]) -> None:
    with pytest.raises(um.BadInput, match=rf"^answer: {key}"):
        check_content("answer", {**content, key: damaged}, "diagnosis")


def test_a_chain_that_explains_most_of_the_gap_may_be_the_machine() -> None:
    assert chain_explains(0.972).startswith("how these logs were made explains 97 % of the squared gap: ")


def test_a_small_gap_names_what_would_remove_it(machine: tuple[System, Logs]) -> None:
    system, logs = machine
    law = effect("coulomb_friction").add(system, JOINT, scales_of(system, logs))
    told = small_gap("theta", 0.002, law, 0.8).replace("\xa0", " ")
    assert told.startswith(
        "the gap of theta is 0.2 % of the motion; dry friction at joint would remove 80 % of its square: "
    )
    spread = effect("scatter").add(system, B, scales_of(system, logs))
    assert "; parameter deviation of b would remove " in small_gap("theta", 0.01, spread, 0.8)
