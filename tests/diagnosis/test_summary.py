"""diagnosis.json keeps to its contract, and the printed lines say the same."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.diagnosis.diagnoses import FRICTION, Said, diagnosis
from tests.diagnosis.studies import JOINT, TORQUE
from unmodelled.base.files import write_json
from unmodelled.diagnosis.answer.sentences import numbers_of, sentences
from unmodelled.diagnosis.answer.summary import summary
from unmodelled.diagnosis.data.result import Diagnosis, Estimate, Remainder
from unmodelled.diagnosis.where.where import Where
from unmodelled.effects.place import Place
from unmodelled.report.diagnosis_tables import parameter_tables

WHERE = Where(
    channels=({"port": "joint", "share": 0.96}, {"port": "actuator:torque", "share": 0.04}),
    regions=({"signal": "omega", "low": -0.02, "high": 0.02, "share": 0.61},),
    factors=({"factor": "group", "level": "old", "share": 0.4},),
    experiments=({"id": "run1", "known": 0.31, "augmented": 0.02},),
    **dict.fromkeys(("lacking", "left", "every")),  # what figures show is no part of it
)
#: What is said besides of a number that the logs determine within its bounds.
SOUND = {"determined": True, "at_bound": False}
LOAD = Said("constant_load", replace(JOINT, factor="group", level="old"), {"F_0": 0.1})
SCATTER = Said("scatter", Place("parameter", "b"), {}, own={"b_deviation": (0.01, 0.0, -0.02, 0.005)})
DRIFT = Said("drift", Place("parameter", "b"), {"b_rate": 0.001}, "parameter")
GAIN = Said("actuator_gain", TORQUE, {"g": 0.05})


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    return diagnosis(tmp_path_factory.mktemp("friction"), FRICTION, LOAD, SCATTER, DRIFT, GAIN)


@pytest.fixture(scope="module")
def content(found: Diagnosis, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """As it is read from the file."""
    path = tmp_path_factory.mktemp("json") / "diagnosis.json"
    write_json(path, summary(found, WHERE))

    loaded: dict[str, Any] = json.loads(path.read_text(), parse_constant=pytest.fail)
    return loaded


def test_the_keys_are_those_of_the_contract(content: dict[str, Any]) -> None:
    assert set(content) == {
        *("schema", "system", "seed", "verdict", "confidence", "chance", "effects", "where", "gap"),
        *("parameters", "remainder", "comparison", "logs", "notes", "refused"),
    }
    assert (content["schema"], content["system"], content["seed"]) == ("diagnosis/2", "pendulum", 3)
    assert (content["verdict"], content["confidence"], content["chance"]) == ("effect", 0.94, 0.0156)
    assert content["notes"] == ["theta was unwrapped"]
    shown = ("channels", "regions", "factors", "experiments")
    assert content["where"] == {name: list(getattr(WHERE, name)) for name in shown}


def test_an_effect_on_a_port(content: dict[str, Any]) -> None:
    effect = content["effects"][0]
    assert effect == {
        "family": "coulomb_friction",
        "port": "joint",
        "law": "F_c*sign(omega)",
        "parameters": {"F_c": {"value": 0.06, "unit": "N m", "interval": [0.054, 0.066], **SOUND}},
        "confidence": 0.97,
        "shrink": 0.81,
        "interval": [0.7, 0.88],
        "indistinguishable": [{"family": "stribeck_friction", "port": "joint"}],
    }


def test_channels_levels_and_variants_are_named(content: dict[str, Any]) -> None:
    load, scatter, drift, gain = content["effects"][1:]
    assert (load["port"], load["factor"], load["level"]) == ("joint", "group", "old")
    assert load["indistinguishable"][0]["level"] == "old"
    assert (scatter["port"], scatter["parameter"], "variant" in scatter) == ("joint", "b", False)
    assert (drift["port"], drift["parameter"], drift["variant"]) == ("joint", "b", "parameter")
    assert gain["port"] == "actuator:torque"
    assert gain["parameters"]["g"]["unit"] == "1"


def test_a_number_of_its_own_in_every_experiment(content: dict[str, Any]) -> None:
    number = content["effects"][2]["parameters"]["b_deviation"]
    assert number["values"] == {"run0": 0.01, "run1": 0.0, "run2": -0.02, "run3": 0.005}
    assert number["value"] == -0.00125
    assert number["unit"] == "1"
    assert number["interval"][0] < number["value"] < number["interval"][1]


def test_gap_and_parameters(content: dict[str, Any], found: Diagnosis) -> None:
    gap = content["gap"]
    assert set(gap) == {
        *("known", "reidentified", "augmented", "neural", "floor", "shrink", "interval", "held_out"),
        *("horizon", "units", "persistence"),
    }
    assert gap["augmented"] == pytest.approx(found.augmented.gap.value, rel=1e-7)
    assert gap["floor"] == pytest.approx(found.augmented.gap.floor, rel=1e-7)
    assert (gap["shrink"], gap["interval"], gap["horizon"]) == (0.99, [0.97, 1.0], 0.1)
    known, augmented = found.known.gap.units["theta"], found.augmented.gap.units["theta"]
    assert gap["units"] == {
        "theta": {
            "unit": "rad",
            "known": pytest.approx(known.at_horizon, rel=1e-7),
            "augmented": pytest.approx(augmented.at_horizon, rel=1e-7),
            "known_whole_run": pytest.approx(known.whole_run, rel=1e-7),
            "augmented_whole_run": pytest.approx(augmented.whole_run, rel=1e-7),
        }
    }
    assert gap["held_out"] == ["run1", "run3"]
    b = {"known": 0.03, "identified": 0.0151, "unit": "N m s/rad", "interval": [0.0149, 0.0153], **SOUND}
    assert content["parameters"] == {"b": b}


def test_candidates_from_best_to_worst(content: dict[str, Any]) -> None:
    several, one, none = content["comparison"]
    assert one == {
        "effects": [{"family": "coulomb_friction", "port": "joint", "kind": "dry friction"}],
        **{"probability": None, "score": 2.4, "difference": 1.5, "standard_error": 0.3, "named": False},
    }
    assert (none["effects"], none["difference"], none["named"]) == ([], 4.1, False)
    assert [e["family"] for e in several["effects"]][:2] == ["coulomb_friction", "constant_load"]
    assert several["effects"][1]["level"] == "old" and several["effects"][2]["parameter"] == "b"
    assert (str(several["difference"]), several["named"]) == ("0.0", True)


def test_numbers_that_are_none_and_those_of_numpy(found: Diagnosis) -> None:
    nothing = Estimate("1", float("nan"), np.float64(2.0), (-np.inf, np.inf), determined=False)
    changed = replace(found, parameters={"b": nothing}, confidence=np.float32(0.5), neural=found.known)
    level = replace(WHERE, factors=[{"factor": "m", "level": np.float64(1.2), "share": np.nan}])
    text = json.dumps(summary(changed, level), allow_nan=False)
    loaded = json.loads(text)
    numbers = {"known": None, "identified": 2.0, "interval": [None, None]}
    assert loaded["parameters"]["b"] == {**numbers, "unit": "1", "determined": False, "at_bound": False}
    assert loaded["where"]["factors"] == [{"factor": "m", "level": 1.2, "share": None}]


@pytest.mark.parametrize(
    ("place", "channel"), [(TORQUE, "actuator:torque"), (Place("parameter", "b"), "joint"), (None, None)]
)
def test_a_remainder_says_how_much_and_where(
    place: Place | None, channel: str | None, found: Diagnosis, content: dict[str, Any]
) -> None:
    changed = replace(found, verdict="main_effect", remainder=Remainder(0.11, 0.07, place))
    told = summary(changed, WHERE)
    assert told["verdict"] == "main_effect"
    assert told["remainder"] == {"share": 0.11, "predictable": 0.07, "channel": channel}
    (line,) = (line for line in sentences(told) if line.startswith("remainder: "))
    assert line.startswith("remainder: 11 % of the squared error in experiments that were left out")
    further = f"; the further effect that predicts best is at {channel}" if channel else ""
    assert line.endswith(f"a network in every port predicts 7 % of the whole{further}")
    assert sentences(told)[-1].startswith("next: simulate augmented_system.yaml on new logs")
    assert content["remainder"] is None and "remainder: " not in "\n".join(sentences(content))


def test_a_wrong_number_beside_which_more_is_missing_is_corrected_first(content: dict[str, Any]) -> None:
    wrong = content["effects"][0] | {"parameter": "J", "text": "J = 0.02 kg m² instead of 0.05 kg m²"}
    told = content | {"effects": [wrong], "verdict": "main_effect", "refused": []}
    assert sentences(told)[-1].startswith("next: correct J in the system file, then diagnose again")
    assert "correct J" not in sentences(told | {"verdict": "effect"})[-1]


def test_a_number_at_a_limit_has_no_interval_that_shrank_to_it() -> None:
    """In the text, in the list of answers, and in the tables of the page."""
    number = {"value": 1.0, "unit": "N/A", "interval": [0.9999998, 1.0], "at_bound": True}
    effect = {"family": "actuator_gain", "port": "actuator:i", "parameters": {"g": number}}
    assert [*numbers_of(effect)] == ["g = 1 N/A, at a limit of its values"]
    (table,) = parameter_tables({"effects": [effect]})
    assert [cell.text for cell in table.rows[0]][1:3] == ["1", "–"]
    open_ = {**effect, "parameters": {"g": {**number, "interval": [0.0, 1.0]}}}
    assert [*numbers_of(open_)] == ["g = 1.0 N/A (95 % interval 0.0 to 1.0), at a limit of its values"]


def test_a_number_has_the_digits_of_its_interval() -> None:
    number = {"value": 2.99969, "unit": "N", "interval": [2.99951, 2.99988], "determined": True}
    effect = {"family": "coulomb_friction", "port": "guide", "parameters": {"F_c": number}}
    assert [*numbers_of(effect)] == ["F_c = 2.99969 N (95 % interval 2.99951 to 2.99988)"]


def test_nothing_shrinks_where_nothing_is_named(content: dict[str, Any]) -> None:
    gap = content["gap"] | {"shrink": 0.0, "interval": [0.0, 0.0]}
    told = sentences(content | {"verdict": "no_gap", "effects": [], "gap": gap})
    assert told[0].startswith("verdict: no gap that matters")
    assert not any(line.startswith("shrink") for line in told)


def test_what_is_printed(found: Diagnosis, content: dict[str, Any]) -> None:
    """The same of an answer that was read from its file."""
    lines = sentences(summary(found, WHERE))
    assert sentences(content) == lines
    text = "\n".join(lines)
    assert lines[0].startswith("verdict: an effect that the model omits explains the gap")
    assert "confidence 0.94" in lines[0]
    for words in (
        "chance: 0.016, the probability that the best of all laws lowers the error as much if nothing is",
        "Coulomb friction at joint: F_c*sign(omega) (explains 81 % of the squared gap above the "
        "noise floor, confidence 0.97)",
        "F_c = 0.060 N m (95 % interval 0.054 to 0.066)",
        "these logs cannot distinguish it from Stribeck friction at joint",
        "Constant load at joint, where group is old",
        "b_deviation = -0.0185 to 0.009625, fitted per experiment",
        "Drift (parameter) of b",
        "b = 0.01510 N m s/rad (95 % interval 0.01490 to 0.01530), 0.03 N m s/rad in the system file",
        f"noise floor {found.augmented.gap.floor:.3g} (in standard deviations of the outputs",
        f"theta: {found.known.gap.units['theta'].at_horizon * 1e3:.2g} mrad off after 0.1 s, ",
        f"with the effects found: {found.augmented.gap.units['theta'].says(0.1)}",
        "on experiments that are left out of the fit, each once)",
        "shrink: 99 % of the squared gap above the noise floor (95 % interval 97 to 100 %)",
        "note: theta was unwrapped",
    ):
        assert words in text
    assert text.index("\ntheta: ") < text.index("\ngap: ")
    assert lines[-1] == "next: simulate augmented_system.yaml on new logs to confirm the effect"


def test_what_diverges_is_said_and_null(found: Diagnosis) -> None:
    gap = found.augmented.gap
    off = replace(gap.units["theta"], at_horizon=None, whole_run=None)
    changed = replace(found, augmented=replace(found.augmented, gap=replace(gap, units={"theta": off})))
    told = summary(changed, WHERE)
    entry = told["gap"]["units"]["theta"]
    assert entry["augmented"] is None and entry["augmented_whole_run"] is None and entry["known"] > 0.0
    text = "\n".join(sentences(told))
    assert "with the effects found: diverges within 0.1 s, diverges over whole runs" in text
