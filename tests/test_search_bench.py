"""The bench of two forms of the diagnosis: rows, resuming, the cap and the comparison, with a stub."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from benchmarks.search_bench.__main__ import compare, run
from benchmarks.search_bench.case import SHARES, Case, cases_of, field, withheld
from benchmarks.search_bench.form import Form
from benchmarks.search_bench.row import read_rows
from pipeline.rigs.withheld.chain.campaign import write_measured
from pipeline.rigs.withheld.chain.drawing import measured_cases
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.systems.reader import read_system

ROOT = Path(__file__).parents[1]
#: Says the family that the word `family=` has; `family=loop` never ends. Writes down that it was called.
STUB = """
import json, pathlib, sys
words = dict(word.split("=", 1) for word in sys.argv[1:] if "=" in word)
out, family = pathlib.Path(words["out"]), words["family"]
with out.with_name("calls").open("a") as calls:
    calls.write(out.name + "\\n")
while family == "loop":
    pass
if family == "fault":
    sys.exit("no such law")
effect = {"family": family, "port": "joint", "law": "x", "parameters": {}, "indistinguishable": []}
named = [] if family == "none" else [effect]
models = [["gravity_load"], ["gravity_load", "backlash"], ["viscous_friction"]]
rows = [
    {"effects": [{"family": f, "port": "joint"} for f in m], "difference": float(k), "named": False}
    for k, m in enumerate(models)
]
gap = dict.fromkeys(("known", "reidentified", "augmented", "neural", "floor", "horizon"), 0.1)
where = dict.fromkeys(("channels", "regions", "factors", "experiments"), [])
content = {
    "schema": "diagnosis/2", "verdict": "effect" if named else "no_gap", "confidence": 0.5, "effects": named,
    "gap": {**gap, "shrink": 0.0, "interval": [0.0, 0.1], "held_out": []}, "where": where, "parameters": {},
    "comparison": rows, "notes": [], "logs": [],
}
out.mkdir()
(out / "index.html").write_text("a page")
(out / "diagnosis.json").write_text(json.dumps(content))
"""


def case(folder: Path, name: str, kind: str, family: str | None) -> Case:
    """A pendulum with a planted effect at its joint, or with none."""
    own = folder / name
    (own / "logs").mkdir(parents=True)
    (own / "logs" / "experiments.csv").write_text("id,file\n")
    shutil.copyfile(ROOT / "systems" / "withheld" / "pendulum.yaml", own / "system.yaml")
    effects = [] if family is None else [{"family": family, "channel": "joint", "alike": []}]
    truth = {
        "verdict": "effect" if effects else "no_gap",
        "system": "pendulum",
        "level": 1.0,
        "effects": effects,
    }
    (own / "truth.json").write_text(json.dumps(truth))
    return Case(name, kind, own, own / "system.yaml", own / "logs")


def form(folder: Path, name: str, family: str) -> Form:
    script = folder / "stub.py"
    script.write_text(STUB)
    return Form(name, ROOT, (f"family={family}",), (str(script),))


def test_rows_are_judged_resumed_and_compared(tmp_path: Path) -> None:
    cases = [
        case(tmp_path, "one", "single", "viscous_friction"),
        case(tmp_path, "nothing", "null", None),
    ]
    forms = [form(tmp_path, "old", "viscous_friction"), form(tmp_path, "new", "none")]
    run(cases, forms, tmp_path)
    rows = {f.name: read_rows(tmp_path / f"rows_{f.name}.jsonl") for f in forms}
    one, nothing = rows["old"]["one"], rows["old"]["nothing"]
    assert (one["first"], one["in_set"], one["exact"], one["right"], one["rank"]) == (
        True,
        True,
        True,
        True,
        [2],
    )
    assert one["error"] == "" and one["cpu"] > 0.0 and one["memory"] > 1.0
    assert one["effects"] == [["viscous_friction", "joint"]]
    assert not nothing["right"] and rows["new"]["nothing"]["right"]
    assert sorted(p.name for p in (tmp_path / "answers" / "old" / "one").iterdir()) == ["diagnosis.json"]

    path = tmp_path / "rows_old.jsonl"
    path.write_text(path.read_text().splitlines()[0] + '\n{"case": "nothi')  # killed while it wrote
    run(cases, forms, tmp_path, jobs=2)
    calls = {f.name: (tmp_path / "answers" / f.name / "calls").read_text().split() for f in forms}
    assert calls == {"old": ["one", "nothing", "nothing"], "new": ["one", "nothing"]}
    assert set(read_rows(path)) == {"one", "nothing"}

    text = compare(["old", "new"], tmp_path)
    assert text == (tmp_path / "compare_old_new.md").read_text()
    assert "| right | 0 | 1 | 1 | 0 | 1 |" in text
    assert "| one | viscous_friction at joint | effect: viscous_friction at joint | no_gap |" in text
    (tmp_path / "one" / "system.yaml").write_text("changed")
    (tmp_path / "rows_new.jsonl").unlink()
    run(cases[:1], forms[1:], tmp_path)
    assert "left out, because their files differ: one" in compare(["old", "new"], tmp_path)


@pytest.mark.parametrize(
    ("family", "error"), [("loop", "killed after"), ("fault", "exit code 1: no such law")]
)
def test_a_form_without_an_answer_is_counted_as_unanswered(tmp_path: Path, family: str, error: str) -> None:
    run(
        [case(tmp_path, "one", "single", "viscous_friction")],
        [form(tmp_path, "new", family)],
        tmp_path,
        cap=1.0,
    )
    assert read_rows(tmp_path / "rows_new.jsonl")["one"]["error"].startswith(error)
    row = next(line for line in compare(["new"], tmp_path).splitlines() if line.startswith("| single"))
    assert row.startswith("| single | new | 1 | 0 of 1") and row.endswith("| 1 |")


def test_any_first_part_of_the_virtual_cases_has_all_kinds(tmp_path: Path) -> None:
    found = withheld(7000, 30, tmp_path)
    assert {one.kind for one in found[:5]} == {one.kind for one in found[24:29]} == set(SHARES)
    assert [one.name for one in withheld(7000, 7, tmp_path)] == [one.name for one in found[:7]]
    assert len({one.name for one in found}) == 30 and found[24].name.startswith("7001_")


def test_a_wrong_number_is_in_the_file_and_in_the_truth(tmp_path: Path) -> None:
    (case,) = cases_of("number:7:1", tmp_path)
    case.make()
    (planted,) = read_json(case.folder / "truth.json")["effects"]
    name = planted["channel"].removeprefix("parameter:")
    (factor,) = planted["parameters"].values()
    right = case.folder / "right"
    write_measured(measured_cases("null", 1, 7)[0], right)
    given, known = (
        {p.name: p.value for p in read_system(system).parameters}
        for system in (case.system, right / "system.yaml")
    )
    assert {n for n in known if given[n] != known[n]} == {name}
    assert given[name] * factor == pytest.approx(known[name])


def test_reported_inputs_have_the_right_answer_of_the_list_beside_them(tmp_path: Path) -> None:
    (own := tmp_path / "reports" / "swing").mkdir(parents=True)
    (own.parent / "README.md").write_text(
        "| folder | had | right |\n|---|---|---|\n| swing | rod | dry friction |\n"
    )
    (own / "make.py").write_text(
        "import pathlib\npathlib.Path('logs').mkdir()\npathlib.Path('logs/run.csv').write_text('t,x')\n"
        "pathlib.Path('system.yaml').write_text('schema: system/1')\n"
    )
    (found,) = field(own.parent, tmp_path / "made")
    assert (found.name, found.truth, found.kind) == ("swing_system_logs", "dry friction", "field")
    assert not (own / "logs").exists()


def test_a_form_must_be_a_working_tree(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="with a working tree"):
        Form.of(f"old:{tmp_path}")
    assert Form.of(f"new:{ROOT},core=equations").words == ("core=equations",)
