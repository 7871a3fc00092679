"""The next experiment: two laws that are alike on the logs are told apart, within the limits."""

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import Array, motion, read_case, system_of, text_of, write_runs
from unmodelled.api.answer import Answer
from unmodelled.api.next_experiment import NextExperiment, next_experiment
from unmodelled.base.errors import BadInput
from unmodelled.cli.verbs.next import next as next_verb
from unmodelled.design.checked import check_answer
from unmodelled.design.content import sentences
from unmodelled.design.criterion import GAIN, Value, distance, weighted
from unmodelled.design.signals import references
from unmodelled.diagnosis.answer.summary import SCHEMA

MASS, DAMPING, FORCE, NOISE, PERIOD = 2.0, 0.5, 0.3, 1e-4, 0.02
LIMITS = """
duration: 2
inputs: {force: {low: -1.5, high: 2, rate: 20}}
travel: {x: {low: -0.3, high: 0.3}}
"""


#: What an answer tells of an effect besides.
TOLD = {"law": "F_0", "confidence": 0.5, "shrink": 0.9, "interval": [0.8, 1.0]}


def moved(force: Array, friction: bool, v: float = 0.0) -> Array:
    """Position (m) and speed (m/s) of the cart, with friction or a load."""

    def rates(x: Array, u: Array) -> list[float]:
        law = FORCE * np.tanh(x[1] / 0.01) if friction else FORCE
        return [x[1], (u - DAMPING * x[1] - law) / MASS]

    return motion(rates, [0.0, v], force, PERIOD)


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """System, limits, logs of forward motion only, and an answer that cannot tell a load from friction."""
    folder = tmp_path_factory.mktemp("cart")
    system_of(text_of("cart.yaml"), folder)
    (folder / "limits.yaml").write_text(LIMITS)
    rng, t, tables = np.random.default_rng(0), PERIOD * np.arange(150), []
    for k in range(4):
        force = 1.0 + 0.4 * np.sin((2.0 + k) * t)
        y = moved(force, True, 0.5) + rng.normal(0.0, NOISE, (150, 2))
        tables.append({"t": t, "force": force, "x": y[:, 0], "v": y[:, 1]})
    write_runs(folder / "logs", tables)
    errors = {"augmented": 2e-4, "augmented_whole_run": 3e-4, "known": 0.1, "known_whole_run": None}
    gaps = dict.fromkeys(("known", "reidentified", "augmented", "neural", "floor", "persistence"), 0.1)
    gaps |= {"shrink": 0.9, "interval": [0.8, 1.0], "held_out": ["run1"], "horizon": 0.4}
    ids = [f"run{k}" for k in range(4)]
    friction = {"family": "coulomb_friction", "port": "rail"}
    load = {"family": "constant_load", "port": "rail", "parameters": {}, "indistinguishable": [friction]}
    load |= TOLD
    answer: dict[str, Any] = {
        "schema": SCHEMA,
        "system": "cart",
        "verdict": "effect",
        "seed": 0,
        "confidence": 0.5,
        "remainder": None,
        "where": {
            **{key: [] for key in ("channels", "regions", "factors")},
            "experiments": [{"id": name, "known": 0.3, "augmented": 0.1} for name in ids],
        },
        "gap": {**gaps, "units": {"x": {"unit": "m", **errors}, "v": {"unit": "m/s", **errors}}},
        **{key: [] for key in ("comparison", "logs", "notes")},
        "effects": [load],
        "parameters": {},
    }
    (folder / "answer").mkdir()
    (folder / "answer" / "diagnosis.json").write_text(json.dumps(answer))
    return folder


def proposed(case: Path, seed: int = 0, limits: Path | None = None, **changed: Any) -> NextExperiment:
    answer = {**json.loads((case / "answer" / "diagnosis.json").read_text()), **changed}
    given = Answer(case, answer, read_case(case))
    return next_experiment(given, limits or case / "limits.yaml", seed)


@pytest.fixture(scope="module")
def found(case: Path) -> NextExperiment:
    return proposed(case)


def gap(force: Array) -> float:
    """Root mean square gap of the positions (m) with a load and with friction."""
    return float(np.sqrt(np.mean((moved(force, True) - moved(force, False))[:, 0] ** 2)))


def test_laws_that_are_alike_on_the_logs_are_told_apart(found: NextExperiment) -> None:
    force = found.table()["force"].to_numpy()
    odds = found.odds.iloc[0]
    assert odds["proposed"] > 0.99
    assert odds["proposed"] >= np.nanmax([0.5, odds["chirp"], odds["random"]]) - GAIN
    limits = found.design.criterion.limits
    chirps = references(limits, 0)["chirp"][:, :, 0]
    inside = [u for u in chirps if all(np.abs(moved(u, f)[:, 0]).max() <= 0.3 for f in (True, False))]
    assert inside and gap(force) >= max(100.0 * NOISE, gap(inside[0]))


def test_a_chirp_is_proposed_where_no_experiment_promises_more(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A force that hardly may change leaves nothing to choose."""
    monkeypatch.setattr("unmodelled.design.design.GENERATIONS", 1)
    monkeypatch.setattr("unmodelled.design.design.REFINED", 1)
    limits = tmp_path / "limits.yaml"
    limits.write_text(
        LIMITS.replace("low: -1.5, high: 2", "low: 1, high: 1.01").replace("high: 0.3", "high: 30")
    )
    held = proposed(case, limits=limits)
    assert held.content["family"] == "chirp"
    np.testing.assert_array_equal(held.design.found.u, held.design.references["chirp"])
    # a distance of one standard deviation tells with 69 %, one of 1.1 with 71 %, those of 6 and 9 with all
    near, further, far, farthest = (
        Value(np.zeros(1), np.array([[d]]), np.zeros((1, 0))) for d in (1.0, 1.1, 6.0, 9.0)
    )
    gains = held.design.criterion.gains
    assert gains(further, near) and not gains(near, further) and not gains(farthest, far)


def test_limits_of_inputs_alone_are_enough(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("unmodelled.design.design.GENERATIONS", 1)
    monkeypatch.setattr("unmodelled.design.design.REFINED", 1)
    limits = tmp_path / "limits.yaml"
    limits.write_text(LIMITS.partition("travel")[0])
    free = proposed(case, limits=limits)
    assert free.odds["proposed"].min() > 0.99 and free.content["travel"] == {}


def test_a_simulation_that_diverges_tells_nothing(found: NextExperiment) -> None:
    """Its numbers are finite, and their squares are not."""
    named = found.design.criterion.rivals[0]
    y, steps = np.zeros((1, 1 + len(named.values), 10, 1)), named.sets[1]
    y[:, 1:, 5:] = np.array([1e200, -1e200, np.inf, np.nan, 1e13])[:, None]
    assert distance(weighted(y, steps), weighted(y[:, :, ::-1], steps)) == 0.0


def test_the_limits_are_kept_by_every_model(found: NextExperiment) -> None:
    force = found.table()["force"].to_numpy()
    assert -1.5 <= force.min() < force.max() <= 2.0
    assert np.abs(np.diff(force)).max() <= 20.0 * PERIOD + 1e-9
    for friction in (True, False):
        assert np.abs(moved(force, friction)[:, 0]).max() <= 0.3 * 1.02


@pytest.mark.long
def test_the_verb_writes_the_experiment_of_the_seed(
    case: Path, found: NextExperiment, capsys: pytest.CaptureFixture[str]
) -> None:
    out = case / "out"
    next_verb(case / "system.yaml", case / "logs", case / "answer", case / "limits.yaml", out)
    assert "tells" in capsys.readouterr().out
    pd.testing.assert_frame_equal(pd.read_csv(out / "experiment.csv"), found.table(), atol=1e-8)
    assert json.loads((out / "next.json").read_text()) == json.loads(json.dumps(found.content))
    assert (out / "next_experiment.svg").stat().st_size > 1000


@pytest.mark.long
def test_a_sensor_of_the_effort_tells_a_load_from_friction_where_motion_cannot(
    case: Path, tmp_path: Path, found: NextExperiment
) -> None:
    """With a force that hardly ever lets the cart return, positions and speeds tell little."""
    limits = tmp_path / "limits.yaml"
    limits.write_text(LIMITS.replace("low: -1.5", "low: 0.9").replace("high: 0.3", "high: 3"))
    out = proposed(case, limits=limits)
    sensor, odds = out.content["sensor"], out.odds["proposed"].min()
    assert odds < 0.9 < 0.95 < min(sensor["odds"])
    assert (sensor["label"], sensor["unit"]) == ("the effort f at rail", "N")
    (line,) = (line for line in repr(out).splitlines() if "sensor of" in line)
    assert "the effort f at rail" in line and f"{100.0 * odds:.3g} %" in line
    assert "sensor of" not in repr(found)  # where the experiment is enough


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("low: -1.5", "low: 3", "low must be below high"),
        ("force:", "torque:", "no 'torque'"),
        ("duration: 2", "duration: -2", "must be positive"),
        ("x: {", "y: {", "no 'y'"),
        ("duration: 2", "duration: 1e9", "samples"),
    ],
)
def test_bad_limits_are_one_line(case: Path, tmp_path: Path, old: str, new: str, message: str) -> None:
    limits = tmp_path / "limits.yaml"
    limits.write_text(LIMITS.replace(old, new))
    with pytest.raises(BadInput, match=message) as error:
        next_verb(case / "system.yaml", case / "logs", case / "answer", limits, tmp_path / "out")
    assert "\n" not in str(error.value) and str(limits) in str(error.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "effect",
    [
        {"family": "discovered_law", "variant": "x**9", "port": "rail"},
        {"family": "discovered_law", "port": "rail"},
        {"family": "magic", "port": "rail"},
        {"family": "coulomb_friction", "port": "wheel"},
    ],
    ids=lambda e: " ".join(e.values()),
)
def test_an_effect_that_cannot_be_added_is_one_line(case: Path, effect: dict[str, str]) -> None:
    effects = [{**TOLD, **effect, "parameters": {}, "indistinguishable": []}]
    with pytest.raises(BadInput, match=f"{effect['family']} at {effect['port']} cannot be added") as error:
        proposed(case, effects=effects)
    assert "\n" not in str(error.value)


def edits(content: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    match content:
        case dict():
            items = list(content.items())
        case list():
            items = list(enumerate(content))
        case _:
            items = []
    for key, value in items:
        yield (*place, key)
        yield from edits(value, (*place, key))


def edited(answer: dict[str, Any], place: tuple[Any, ...], value: Any) -> dict[str, Any]:
    """An answer with another value at a place; `...` removes the entry."""
    new = copy.deepcopy(answer)
    within = new
    for key in place[:-1]:
        within = within[key]
    if value is ...:
        del within[place[-1]]
    else:
        within[place[-1]] = value
    return new


@pytest.fixture
def answer(case: Path) -> dict[str, Any]:
    """An answer with a number of the named effect."""
    found: dict[str, Any] = json.loads((case / "answer" / "diagnosis.json").read_text())
    found["effects"][0]["parameters"] = {"F": {"value": 0.3, "interval": [0.29, 0.31], "unit": "N"}}
    return found


AT_OIL = {"family": "coulomb_friction", "port": "rail", "factor": "oil"}
BRAKE = {"name": "brake", "formula": "c*v", "numbers": {"c": {"unit": "N s/m", "plausible": 1.0}}}
WRONG: tuple[Any, ...] = (..., None, "x", "", -1, 0, 1e308, [], {}, True, [1], {"a": 1}, [None, None], -5.5)


def test_an_edited_answer_is_one_line(case: Path, answer: dict[str, Any]) -> None:
    system, logs = read_case(case)
    refused = 0
    for place in edits(answer):
        for value in WRONG:
            try:
                check_answer(system, logs, edited(answer, place, value))
            except BadInput as fault:
                refused += 1
                assert "\n" not in str(fault) and len(str(fault)) < 200
    assert refused > 250


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (("effects", 0, "parameters", "F", "value"), "much", "effects[0].parameters.F.value"),
        (("effects", 0, "parameters", "F", "interval"), [0.3], "interval: must have 2 entries, got 1"),
        (("effects", 0, "indistinguishable", 0), ..., ""),
        (("effects", 0, "indistinguishable"), ..., "effects[0]: indistinguishable is missing"),
        (("effects", 0, "factor"), "oil", "effects[0]: 'level' is a dependency of 'factor'"),
        (("effects", 0, "indistinguishable", 0), {**AT_OIL, "level": "old"}, "there is no factor 'oil'"),
        (("effects", 0, "signal"), "sun", "there is no signal 'sun'"),
        (("gap", "units", "v"), ..., "gap.units: has no output v"),
        (("gap", "horizon"), -1, "horizon"),
        (("seed",), 0.5, "seed: must be a whole number"),
        (("laws",), [{**BRAKE, "only": 5}], "laws[0].only: must be a list, got 5"),
        (("laws",), [{**BRAKE, "force": 5}], "laws[0]: unknown key 'force'"),
    ],
)
def test_an_edit_is_named(
    case: Path, answer: dict[str, Any], place: tuple[Any, ...], value: Any, message: str
) -> None:
    system, logs = read_case(case)
    if not message:
        check_answer(system, logs, edited(answer, place, value))
        return
    with pytest.raises(BadInput) as error:
        check_answer(system, logs, edited(answer, place, value))
    assert message in str(error.value)


LAW: dict[str, Any] = {
    "name": "drag",
    "formula": "c*v*abs(v)",
    "numbers": {"c": {"unit": "N s^2/m^2", "plausible": 0.1, "low": 0.0}},
    "at": "port",
    "only": ["rail"],
}


def test_laws_of_an_answer_are_read_as_those_of_a_file(case: Path, answer: dict[str, Any]) -> None:
    system, logs = read_case(case)
    (law,) = check_answer(system, logs, answer | {"laws": [LAW]})
    assert law.definition == LAW
    refused = 0
    for place in edits(LAW):
        for value in (*WRONG, float("nan"), {"b": [[[[[[1]]]]]]}, "v" * 500):
            try:
                check_answer(system, logs, answer | {"laws": [edited(LAW, place, value)]})
            except BadInput as fault:
                refused += 1
                assert "\n" not in str(fault)
    assert refused > 100


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"colour": "red"}, r"laws\[0\]: unknown key 'colour'"),
        ({"only": 5}, r"laws\[0\].only: must be a list, got 5"),
        ({"only": "rail"}, r"laws\[0\].only: must be a list"),
        (
            {"numbers": {"c": LAW["numbers"]["c"] | {"low": "a"}}},
            "numbers.c.low: must be a number or null, got 'a'",
        ),
        ({"numbers": {"c": LAW["numbers"]["c"] | {"low": []}}}, "numbers.c.low: must be a number"),
        ({"numbers": {"c": LAW["numbers"]["c"] | {"lowest": 1}}}, "unknown key 'lowest'"),
        ({"name": "coulomb_friction"}, "the name is taken"),
    ],
    ids=lambda e: next(iter(e)) if isinstance(e, dict) else "",
)
def test_a_law_of_an_answer_that_no_file_has_is_one_line(
    case: Path, answer: dict[str, Any], changed: dict[str, Any], message: str
) -> None:
    with pytest.raises(BadInput, match=message) as error:
        proposed(case, **answer | {"laws": [LAW | changed]})
    assert "\n" not in str(error.value) and str(error.value).startswith("answer: ")


@pytest.mark.long
@pytest.mark.parametrize("value", [None, 0, -1, 1e-308, 1e90])
@pytest.mark.parametrize("key", ["value", "interval"])
def test_a_number_that_an_edit_left_plausible_is_designed_with(
    case: Path, answer: dict[str, Any], key: str, value: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("unmodelled.design.design.GENERATIONS", 0)
    monkeypatch.setattr("unmodelled.design.design.REFINED", 0)
    answer["effects"][0]["parameters"]["F"][key] = value if key == "value" else [value, 1.0]
    try:
        assert np.isfinite(proposed(case, **answer).odds["proposed"]).all()
    except BadInput as fault:  # no experiment keeps the limits for every number of so wide an interval
        assert "within the intervals of the answer" in str(fault) and key == "interval"


def test_the_answer_says_where_its_system_and_logs_are(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[tuple[Path, Path]] = []

    def stop(system: Path, logs: Path) -> None:
        read.append((system, logs))
        raise BadInput("enough")

    monkeypatch.setattr("unmodelled.api.answer.read_inputs", stop)
    content = json.loads((case / "answer" / "diagnosis.json").read_text())
    limits, system, logs = case / "limits.yaml", case / "system.yaml", case / "logs"

    def run(**sources: Any) -> str:
        (tmp_path / "answer").mkdir(exist_ok=True)
        (tmp_path / "answer" / "diagnosis.json").write_text(json.dumps({**content, **sources}))
        with pytest.raises(BadInput) as error:
            next_verb(None, None, tmp_path / "answer", limits, tmp_path / "out")
        return str(error.value)

    assert run(sources={"system": str(system), "logs": str(logs)}) == "enough"
    assert read == [(system, logs)]
    assert "does not say where its system is: add system=<path>" in run()
    assert "sources: must be an object, got a list" in run(sources=[1])
    assert "no longer at" in run(sources={"system": str(system), "logs": "/nowhere/at/all"})


@pytest.mark.parametrize(
    ("proposed", "said"),
    [
        (2.221e-4, "no experiment within the limits was found that narrows the 95 % interval of F_c"),
        (2.1e-4, "narrows the 95 % interval of F_c = 0.006 N m from ± 0.00022 to ± 0.00021"),
    ],
)
def test_an_interval_that_stays_as_wide_is_not_narrowed(proposed: float, said: str) -> None:
    after = {"proposed": proposed, "chirp": 2.224e-4, "random": None}
    found = {
        **{"start": {}, "duration": 4.0, "family": "chirp", "alternatives": [], "criterion": "intervals"},
        **{"inputs": {"i": {"low": -0.7, "high": 0.7, "rate": None, "unit": "mA"}}, "notes": []},
        "travel": {"x": {"low": None, "high": 3.0, "rate": 2.0, "unit": "mm"}},
        "numbers": {
            "F_c": {"after": after, "worst": after, "before": 2.2248e-4, "unit": "N m", "value": 0.006}
        },
    }
    (line,) = [line for line in sentences(found) if "interval" in line]
    assert said in line
    assert ("widen the limits" in line) == line.startswith("no experiment")
    (limits,) = [line for line in sentences(found) if line.startswith("limits")]
    assert limits.endswith("x up to 3 mm, at most 2 mm/s")
