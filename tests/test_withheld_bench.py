"""The benchmark Withheld: cases without their truth, entrants, resuming, the cap, scores and tables."""

import json
import re
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import psutil
import pytest

from benchmarks.withheld import row as withheld
from benchmarks.withheld import score as scored
from benchmarks.withheld.case import SHARES, Case, cases_of
from benchmarks.withheld.entrant import Entrant
from benchmarks.withheld.measured import field
from benchmarks.withheld.table import main as write_tables
from benchmarks.withheld.table import read_rows
from benchmarks.withheld.wrong_logs import FAULTS, Fault
from pipeline.rigs.withheld.chain.campaign import write_measured
from pipeline.rigs.withheld.chain.drawing import measured_cases
from tests.commands import ROOT, python
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.systems.reader import read_system

COULOMB = ROOT / "benchmarks" / "withheld" / "entrants" / "coulomb.py"
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
effect |= {"confidence": 0.5, "shrink": 0.0, "interval": [0.0, 0.1]}
named = [] if family == "none" else [effect]
models = [["gravity_load"], ["gravity_load", "backlash"], ["viscous_friction"]]
rows = [
    {"effects": [{"family": f, "port": "joint"} for f in m], "difference": float(k), "named": False,
     "score": 1.0, "standard_error": 0.1}
    for k, m in enumerate(models)
]
gap = dict.fromkeys(("known", "reidentified", "augmented", "neural", "floor", "persistence", "horizon"), 0.1)
where = dict.fromkeys(("channels", "regions", "factors", "experiments"), [])
content = {
    "schema": "diagnosis/2", "verdict": "effect" if named else "no_gap", "confidence": 0.5, "effects": named,
    "gap": {**gap, "shrink": 0.0, "interval": [0.0, 0.1], "held_out": [], "units": {}}, "where": where,
    "comparison": rows, "notes": [], "logs": [], "system": "pendulum", "seed": 0, "remainder": None,
    "parameters": {},
}
out.mkdir()
(out / "index.html").write_text("a page")
(out / "diagnosis.json").write_text(json.dumps(content))
"""


def case(folder: Path, name: str, kind: str, family: str | None) -> Case:
    """A pendulum with a planted effect at its joint, or with none."""
    own, apart = folder / "cases" / name, folder / "truth" / name
    (own / "logs").mkdir(parents=True)
    apart.mkdir(parents=True)
    (own / "logs" / "experiments.csv").write_text("id,file\n")
    shutil.copyfile(ROOT / "systems" / "withheld" / "pendulum.yaml", own / "system.yaml")
    effects = [] if family is None else [{"family": family, "channel": "joint", "alike": []}]
    verdict = "effect" if effects else "no_gap"
    truth = {"verdict": verdict, "system": "pendulum", "level": 1.0, "effects": effects, "acts_at": {}}
    (apart / "truth.json").write_text(json.dumps(truth))
    return Case(name, kind, own / "system.yaml", own / "logs", apart=apart)


def entrant(folder: Path, name: str, family: str) -> Entrant:
    script = folder / "stub.py"
    script.write_text(STUB)
    return Entrant.of(f"{name}:{script}+family={family}")


def given(cases: list[Case], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(withheld, "cases_of", lambda word, folder: cases)


def answer_all(cases: list[Case], who: Entrant, out: Path, cap: float = 300.0) -> None:
    for number in range(len(cases)):
        withheld.answer("", number, who, out, cap)


def test_rows_are_judged_resumed_and_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    planted = {"one": ("single", "viscous_friction"), "nothing": ("null", None)}
    cases = [case(tmp_path, name, *of) for name, of in planted.items()]
    given(cases, monkeypatch)
    old, new = entrant(tmp_path, "old", "viscous_friction"), entrant(tmp_path, "new", "none")
    for who in (old, new):
        answer_all(cases, who, tmp_path)
    rows = {who.name: read_rows(tmp_path / "rows" / who.name) for who in (old, new)}
    one, nothing = rows["old"]["one"], rows["old"]["nothing"]
    assert one["first"] and one["in_set"] and one["exact"] and one["right"] and one["rank"] == [2]
    assert one["seen"] == [True] and nothing["seen"] == []
    assert one["error"] == "" and one["cpu"] > 0.0 and one["memory"] > 1.0
    assert one["effects"] == [["viscous_friction", "joint"]] and one["brier"] == 0.25
    assert not nothing["right"] and nothing["extra"] == 1 and rows["new"]["nothing"]["right"]
    kept = {p.name for p in (tmp_path / "answers" / "old" / "one").iterdir()}
    assert kept == {"answer.json", "diagnosis.json"}

    (tmp_path / "rows" / "old" / "nothing.json").unlink()
    answer_all(cases, old, tmp_path)
    calls = (tmp_path / "answers" / "old" / "calls").read_text().split()
    assert calls == ["one", "nothing", "nothing"]

    write_tables(["old", "new", f"out={tmp_path}"])
    text = (tmp_path / "compare_old_new.md").read_text()
    assert text in capsys.readouterr().out
    assert "| right | 0 | 1 | 1 | 0 | 1 |" in text
    assert "| one | viscous_friction at joint | effect: viscous_friction at joint | no_gap |" in text
    page = (tmp_path / "index.html").read_text()
    assert 'href="answers/old/one/answer.json"' in page and "1 of 2: 50 % (9 to 91)" in page
    (tmp_path / "cases" / "one" / "system.yaml").write_text("changed")
    (tmp_path / "rows" / "new" / "one.json").unlink()
    withheld.answer("", 0, new, tmp_path)
    write_tables(["old", "new", f"out={tmp_path}"])
    assert "left out, because their files differ: one" in (tmp_path / "compare_old_new.md").read_text()


def test_an_entrant_that_compares_no_models_is_in_the_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cases = [case(tmp_path, "one", "single", "coulomb_friction")]
    given(cases, monkeypatch)
    answer_all(cases, Entrant.of(f"coulomb:{COULOMB}"), tmp_path)
    write_tables(["coulomb", f"out={tmp_path}"])
    assert "\n| single | coulomb | 1 | 1 of 1" in (tmp_path / "compare_coulomb.md").read_text()


@pytest.mark.parametrize(
    ("family", "error"), [("loop", "killed after"), ("fault", "exit code 1: no such law")]
)
def test_a_case_without_an_answer_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, family: str, error: str
) -> None:
    cases = [case(tmp_path, "one", "single", "viscous_friction")]
    given(cases, monkeypatch)
    answer_all(cases, entrant(tmp_path, "new", family), tmp_path, cap=1.0)
    assert read_rows(tmp_path / "rows" / "new")["one"]["error"].startswith(error)
    write_tables(["new", f"out={tmp_path}"])
    lines = (tmp_path / "compare_new.md").read_text().splitlines()
    row = next(line for line in lines if line.startswith("| single"))
    assert row.startswith("| single | new | 1 | 0 of 1") and row.endswith("| 1 |")


def test_any_first_part_of_the_virtual_cases_has_all_kinds(tmp_path: Path) -> None:
    found = cases_of("planted:7000:30", tmp_path)
    assert {one.kind for one in found[:5]} == {one.kind for one in found[24:29]} == set(SHARES)
    assert [one.name for one in cases_of("planted:7000:7", tmp_path)] == [one.name for one in found[:7]]
    assert len({one.name for one in found}) == 30 and found[24].name.startswith("7001_")
    others = cases_of("further:7000:24", tmp_path)
    assert [one.kind for one in others] == [one.kind for one in found[:24]]
    assert not {one.name for one in others} & {one.name for one in found}
    still = cases_of("balance:7000:13", tmp_path)
    assert [still[12].name[:4], {one.kind for one in still}] == ["7001", {"single", "null"}]


@pytest.mark.long
def test_a_wrong_number_is_in_the_file_and_the_truth_is_apart(tmp_path: Path) -> None:
    (case,) = cases_of("number:7:1", tmp_path)
    case.make()
    assert isinstance(case.make, partial)
    case.make.args[1]()  # another job made it in the meantime
    assert {p.name for p in (tmp_path / "cases").iterdir()} == {case.name}
    assert case.apart is not None
    assert {p.name for p in case.system.parent.iterdir()} == {"system.yaml", "logs"}
    assert {"truth.json", "validation"} <= {p.name for p in case.apart.iterdir()}
    (planted,) = read_json(case.apart / "truth.json")["effects"]
    name = planted["channel"].removeprefix("parameter:")
    (factor,) = planted["parameters"].values()
    write_measured(measured_cases("null", 1, 7)[0], tmp_path / "right")
    files = case.system, tmp_path / "right" / "system.yaml"
    given, known = ({p.name: p.value for p in read_system(file).parameters} for file in files)
    assert {n for n in known if given[n] != known[n]} == {name}
    assert given[name] * factor == pytest.approx(known[name])


@pytest.mark.long
def test_wrong_logs_differ_from_their_twin_where_the_truth_says_so(tmp_path: Path) -> None:
    one, twin = cases_of("wrong_logs:7:2", tmp_path)
    for each in (one, twin):
        each.make()
    assert one.apart is not None and twin.apart is not None
    fault = read_json(one.apart / "truth.json")["fault"]
    assert fault["problem"] == FAULTS[7].name == "spikes" and not fault["decides"]
    files = sorted(p.name for p in one.logs.glob("*.parquet"))
    both = [tuple(pd.read_parquet(c.logs / file) for c in (one, twin)) for file in files]
    changed = {name for a, b in both for name in a if not a[name].equals(b[name])}
    assert changed == {*fault["channels"]}
    assert "fault" not in read_json(twin.apart / "truth.json")


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_changes_only_the_channels_that_it_names(fault: Fault, tmp_path: Path) -> None:
    system = read_system(ROOT / "systems" / "withheld" / "pendulum.yaml")
    rng = np.random.default_rng(0)
    t = np.arange(200) / 128
    names = ("torque", "theta", "omega")
    runs = [pd.DataFrame({"t": t, **{n: rng.normal(size=200).round(3) for n in names}}) for _ in "ab"]
    runs[0].to_parquet(tmp_path / "0.parquet")
    runs[1].to_csv(tmp_path / "1.csv", index=False)
    (tmp_path / "experiments.csv").write_text("id,file\n0,0.parquet\n1,1.csv\n")
    channels = fault.plant(system, tmp_path, rng)
    after = [pd.read_parquet(tmp_path / "0.parquet"), pd.read_csv(tmp_path / "1.csv")]
    changed = {n for a, b in zip(runs, after, strict=True) for n in a if not a[n].equals(b[n])}
    assert changed and changed <= {*channels}


def test_wrong_logs_are_right_where_the_channel_is_named() -> None:
    fault = {"problem": "unit", "channels": ["theta"], "decides": True}
    truth = {"verdict": "no_gap", "effects": [], "fault": fault}
    said = {"verdict": "check_logs", "confidence": 0.9, "effects": []}
    for channel, right in (("theta", True), ("torque", False)):
        found = scored.score(truth, said | {"logs": [{"channel": channel}]})
        assert found["right"] is right and found["first"] is None and found["truth"] == "unit of theta"
    cured = truth | {"fault": {"problem": "spikes", "channels": ["theta"], "decides": False}}
    assert scored.score(cured, {"verdict": "no_gap", "confidence": 0.9, "effects": [], "logs": []})["right"]


def test_a_number_is_scored_by_its_interval() -> None:
    planted = {"family": "coulomb_friction", "channel": "rail", "alike": [], "parameters": {"force": 2.0}}
    truth = {"verdict": "effect", "effects": [planted]}
    effect = {"family": "coulomb_friction", "port": "rail", "indistinguishable": []}
    for interval, inside in (([1.5, 2.5], [True]), ([0.0, 1.0], [False])):
        named = effect | {"number": {"value": 1.0, "interval": interval}}
        said = {"verdict": "effect", "confidence": 1.0, "effects": [named], "logs": []}
        assert scored.score(truth, said)["inside"] == inside


def rates_of(told: str) -> dict[str, str]:
    return dict(re.split("  +", line, maxsplit=1) for line in told.splitlines() if "  " in line.strip())


#: What jsonschema needs.
NEEDED = "attr", "attrs", "referencing", "jsonschema_specifications", "rpds", "typing_extensions.py"


def test_the_example_entrant_is_scored_with_two_packages(tmp_path: Path) -> None:
    """The entrant sees no installed package, and the scorer those that it says it needs."""
    case(tmp_path, "one", "single", "coulomb_friction")
    case(tmp_path, "nothing", "null", None)
    bare = ["-I", "-S"]
    for name in ("one", "nothing"):
        words = f"system={tmp_path}/cases/{name}/system.yaml", f"out={tmp_path}/answers/{name}"
        assert python(*bare, COULOMB, *words).returncode == 0
    (tmp_path / "packages").mkdir()
    installed = Path(psutil.__file__).parents[1]
    for name in ("psutil", "jsonschema", *NEEDED):
        (tmp_path / "packages" / name).symlink_to(installed / name)
    paths = [str(ROOT), str(tmp_path / "packages")]
    code = f"import sys; sys.path[:0] = {paths!r}\nfrom benchmarks.withheld.score import main\n"
    code += "main(sys.argv[1:])"
    words = f"truth={tmp_path}/truth", f"answers={tmp_path}/answers"
    rates = rates_of(python(*bare, "-c", code, *words).stdout)
    assert rates["right"] == "1 of 2: 50 % (9 to 91)" and rates["named first"].startswith("1 of 1")
    assert rates["Brier score"] == "0.250"

    (tmp_path / "answers" / "one" / "answer.json").unlink()
    rates = rates_of(python(*bare, "-c", code, *words).stdout)
    assert rates["right"].startswith("0 of 2") and rates["named first"].startswith("0 of 1")
    assert rates["without an answer"].startswith("1 of 2")


@pytest.mark.long
def test_a_sweep_answers_every_case_once(tmp_path: Path) -> None:
    """The command of the manual, from Hydra to the rows."""
    words = ["cases=planted:7:2", f"entrant=coulomb:{COULOMB}", f"out={tmp_path}", "case=range(0,3)"]
    ran = python("-m", "benchmarks.withheld", "-m", *words)
    assert ran.returncode == 2 and ran.stderr.strip() == "case: must be 0 to 1 of planted:7:2, got 2"
    assert len(read_rows(tmp_path / "rows" / "coulomb")) == 2
    assert ran.stdout.count("coulomb_friction at") >= 2


@pytest.mark.long
def test_a_sweep_on_all_cores_answers_every_case(tmp_path: Path) -> None:
    words = ["cases=planted:7:2", f"entrant=coulomb:{COULOMB}", f"out={tmp_path}", "case=range(0,2)"]
    ran = python("-m", "benchmarks.withheld", "-m", *words, "hydra/launcher=joblib")
    assert ran.returncode == 0, ran.stderr[-1000:]
    assert len(read_rows(tmp_path / "rows" / "coulomb")) == 2


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


def test_an_entrant_is_a_method_a_script_or_a_working_tree(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="with a working tree"):
        Entrant.of(f"old:{tmp_path}")
    assert Entrant.of(f"new:{ROOT}+core=equations").words == ("core=equations",)
    assert Entrant.of("file").program[-1] == "file" and Entrant.of("unmodelled").checkout == ROOT
