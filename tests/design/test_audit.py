"""Sets of numbers beside logs: which numbers hold, which make up for a law, which set predicts best."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import unmodelled as um
from tests.commands import python
from tests.machines.folders import Array, changed, logs_of, system_of, text_of
from unmodelled.base.files import read_json
from unmodelled.cli.verbs.audit import audit as audit_verb
from unmodelled.design.audit.fits import opened_system
from unmodelled.design.audit.number_sets import FILE, number_sets
from unmodelled.systems.reader import read_system

SYSTEM, LOGS = um.example("pendulum")
#: Damping of the pendulum, and what a fit without its dry friction makes of it, N m s/rad.
DAMPING, BENT = 0.015, 0.0254


def read(given: Any) -> Mapping[str, float]:
    (_, found) = number_sets({"own": given}, SYSTEM)
    return found.values


@pytest.mark.parametrize(
    ("text", "name"),
    [("b: 15 mN m s/rad\nJ: 0.02\n", "own.yaml"), ('{"b": "0.015 N m s/rad", "J": 2e-2}', "own.json")],
)
def test_a_file_of_numbers_may_have_units(text: str, name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    (file, found) = number_sets([tmp_path / name], SYSTEM)
    assert (file.name, found.name, found.source) == (FILE, "own", str(tmp_path / name))
    assert found.values == pytest.approx({"b": 0.015, "J": 0.02})
    assert file.values == {"J": 0.02, "b": 0.01, "mgl": 1.2}


def test_a_system_file_of_the_same_structure_is_a_set(tmp_path: Path) -> None:
    text = Path(SYSTEM.source).read_text()
    path = tmp_path / "tuned.yaml"
    path.write_text(changed(text, ("value: 0.01", "value: 0.03")))
    assert read(path) == {"J": 0.02, "b": 0.03, "mgl": 1.2} == read(read_system(path))
    assert read({"b": np.float64(0.03)}) == {"b": 0.03}
    path.write_text(changed(text, ("- b*omega", "- b*omega - 0.001*omega**3")))
    with pytest.raises(um.BadInput, match=r"tuned.yaml: dynamics: differ from those of .*pendulum.yaml"):
        read(path)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"B": 0.1}, "no parameter 'B'; did you mean 'b'?"),
        ({"b": "0.1 kg"}, "own: b: the unit 'kg' does not fit: b is in N m s/rad"),
        ({"b": "much"}, "own: b: must be a number, with its unit or without, such as 0.01 N m s/rad"),
        ({"b": float("nan")}, "must be a number"),
        ({"b": [1.0]}, "must be a number"),
        ({}, "has no numbers: write lines such as"),
        (3.0, "must be numbers by name, a system or a file, got float"),
    ],
)
def test_what_is_no_set_is_one_line(given: Any, words: str) -> None:
    with pytest.raises(um.BadInput) as fault:
        read(given)
    assert words in str(fault.value)


def test_all_faulty_sets_are_told_together() -> None:
    with pytest.raises(um.BadInput, match="no parameter 'c'") as fault:
        number_sets({"one": {"c": 1.0}, "two": {"b": "1 m"}, FILE: {"b": 1.0}}, SYSTEM)
    assert [line.split(":")[0] for line in fault.value.others] == ["sets", "sets"]
    with pytest.raises(um.BadInput, match="must be a list of files"):
        number_sets("tuned.yaml", SYSTEM)


def test_numbers_that_a_set_doubts_are_open_within_bounds_that_hold_all_values() -> None:
    sets = number_sets({"own": {"b": 0.5, "mgl": 1.3}}, SYSTEM)
    opened = {p.name: p for p in opened_system(SYSTEM, sets, ()).parameters}
    assert {name for name, p in opened.items() if p.identify} == {"b", "mgl"}
    assert opened["b"].bounds == (0.0, 0.5)
    low, high = opened["mgl"].bounds or (0.0, 0.0)
    assert 0.0 < low < 0.01 and high > 100.0
    chosen = opened_system(SYSTEM, sets, ("J",))
    assert [p.name for p in chosen.parameters if p.identify] == ["J"]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"parameters": ["c"]}, "parameters: .* has no parameter 'c'"),
        ({"close": 0.0}, "close: must be a share between 0 and 1"),
        ({"seed": -1}, "seed: must be a whole number"),
    ],
)
def test_a_key_that_cannot_be_used_is_refused_at_once(more: dict[str, Any], words: str) -> None:
    with pytest.raises(um.BadInput, match=words):
        um.audit(SYSTEM, LOGS, **more)


def test_the_verb_writes_nothing_where_a_set_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text("b: 0.1 kg\n")
    words = [f"system={SYSTEM.source}", f"logs={LOGS.source}", f"sets=[{tmp_path / 'own.yaml'}]"]
    ended = python("-m", "unmodelled", "audit", *words, f"out={tmp_path / 'out'}", cwd=tmp_path)
    assert ended.returncode == 2
    assert "own.yaml: line 1: b: the unit 'kg' does not fit" in ended.stderr
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def audited(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pendulum, whose dry friction a fit without it makes up for by damping, as the verb writes it."""
    folder = tmp_path_factory.mktemp("audit")
    (folder / "tuned.yaml").write_text(f"b: {BENT}\n")
    (folder / "right.json").write_text(json.dumps({"b": f"{1e3 * DAMPING} mN m s/rad", "J": 0.0201}))
    (folder / "odd.yaml").write_text("b: 0.04 N m s/rad\nmgl: 1.5 N m\n")
    sets = [str(folder / name) for name in ("tuned.yaml", "right.json", "odd.yaml")]
    audit_verb(Path(SYSTEM.source), Path(LOGS.source), sets, folder / "out")
    return folder / "out"


@pytest.mark.long
def test_a_number_that_makes_up_for_a_law_is_told_from_one_that_is_right(audited: Path) -> None:
    found = read_json(audited / "audit.json")
    assert (found["schema"], found["verdict"]) == ("audit/1", "effect")
    assert found["laws"] == ["Coulomb friction at joint"]
    numbers = {row["name"]: row for row in found["numbers"]}
    assert {name: row["kind"] for name, row in numbers.items()} == {
        "J": "determined",
        "b": "absorbs",
        "mgl": "determined",
    }
    for name, true in (("J", 0.02), ("b", DAMPING), ("mgl", 1.2)):
        low, high = numbers[name]["interval"]
        assert low <= true <= high
    (move,) = numbers["b"]["moves"]
    assert move["family"] == "coulomb_friction" and move["value"] == pytest.approx(BENT, rel=0.05)
    marks = {name: own["mark"] for name, own in numbers["b"]["sets"].items()}
    assert marks == {
        "tuned": "absorbs",
        "right": "agrees",
        "odd": "contradicted",
        "system file": "contradicted",
    }
    assert numbers["mgl"]["sets"]["odd"]["mark"] == "contradicted"
    assert numbers["J"]["sets"]["right"]["mark"] == "agrees"  # 0.5 % off is as good as the same
    assert "tuned" not in numbers["J"]["sets"]


@pytest.mark.long
def test_the_set_that_predicts_best_is_another_one_with_the_missing_law(audited: Path) -> None:
    found = read_json(audited / "audit.json")
    sets = {one["name"]: one for one in found["sets"]}
    assert found["sets"][0]["name"] == "tuned"
    assert sets["tuned"]["as_given"]["probability"] > 0.9
    assert sets["right"]["with_laws"]["probability"] > 0.9
    for key in ("as_given", "with_laws"):
        assert sum(one[key]["probability"] for one in found["sets"]) == pytest.approx(1.0)
    right = sets["right"]["with_laws"]["errors"]["theta"]
    assert right < 0.5 * sets["tuned"]["with_laws"]["errors"]["theta"]
    assert found["refitted"]["with_laws"]["theta"] <= 1.1 * right
    rows = pd.read_csv(audited / "sets.csv").set_index("set")
    assert rows.loc["right", "theta with laws"] == pytest.approx(right)
    table = pd.read_csv(audited / "numbers.csv").set_index("number")
    assert table.loc["b", "tuned says"] == "absorbs" and np.isnan(table.loc["J", "tuned"])


#: Rates of the motions of the oscillator, rad/s.
MOTIONS = ((1.3, 3.1, 7.7), (0.9, 4.3, 6.1), (2.2, 3.7, 8.5), (1.7, 5.2, 6.8))


def driven(rates: tuple[float, ...], seed: int) -> dict[str, Array]:
    """A log of the oscillator of the tests: m = 2, k = 50, b = 3, K = 4."""
    t, w = np.arange(0.0, 6.0, 0.004), np.array(rates)[:, None]
    phase = w * t + seed * (1.0 + np.arange(len(rates)))[:, None]
    x, v, a = (np.sin(phase) / w).sum(0), np.cos(phase).sum(0), (-w * np.sin(phase)).sum(0)
    noise = np.random.default_rng(seed).normal(0.0, 1e-3, (2, len(t)))
    return {"t": t, "x": x + noise[0], "v": v + noise[1], "u": (2.0 * a + 3.0 * v + 50.0 * x) / 4.0}


@pytest.mark.long
def test_numbers_of_which_only_ratios_show_are_contradicted_by_ratios_only(tmp_path: Path) -> None:
    text = text_of("oscillator.yaml", ("K: {value: 4.0", "K: {value: 4.4"))
    system = system_of(text, tmp_path)
    logs = logs_of(system, tmp_path, [driven(rates, k) for k, rates in enumerate(MOTIONS)])
    true = {"m": 2.0, "k": 50.0, "b": 3.0, "K": 4.0}
    twice = {name: 2.0 * value for name, value in true.items()}
    found = um.audit(
        system,
        logs,
        {"true": true, "twice": twice, "stiff": {**true, "k": 60.0}},
        parameters=["m", "k", "b", "K"],
        quiet=True,
    )
    rows = {row.name: row for row in found.found.numbers}
    assert {rows[name].kind for name in true} == {"combined"}
    assert set(rows["k"].tied) == {"m", "b", "K"}
    assert "determine only" in rows["m"].sentence
    for name in true:
        assert rows[name].marks["true"] == rows[name].marks["twice"] == "open"
        assert rows[name].marks["stiff"] == "contradicted"
    assert rows["spare"].kind == "known" and found.laws == ()
    errors = found.sets().set_index("set")["x"]
    assert (
        errors["true"] == pytest.approx(errors["twice"], rel=1e-3) and errors["stiff"] > 5.0 * errors["true"]
    )
