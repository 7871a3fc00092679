"""What is said of a mistyped command, and at the end of one that has done its work."""

import functools
import inspect
import json
import os
import string
import subprocess
import time
from importlib import import_module
from pathlib import Path

import pytest

from pipeline.__main__ import PROGRAM, main
from pipeline.rigs.pendulum import PendulumCampaign
from tests.commands import exit_code, python
from unmodelled.base.errors import LONGEST, BadInput, Faults
from unmodelled.cli.refusal import FAULTS
from unmodelled.cli.written import written

ROOT = Path(__file__).parents[2]


def said(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, list[str]]:
    """Exit code, and the lines on standard error; nothing is on standard output."""
    code, printed = exit_code(*arguments), capsys.readouterr()
    assert printed.out == ""
    return code, printed.err.splitlines()


SIMULATE = "system, logs, horizon, only, out"
KEYS = "(all keys: python -m pipeline help simulate)"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("diagnos", "unknown verb 'diagnos'; did you mean 'diagnose'?"),
        ("help diagnos", "unknown verb 'diagnos'; did you mean 'diagnose'?"),
        ("Simulate", "unknown verb 'Simulate'; did you mean 'simulate'?"),
        ("xyz", "unknown verb 'xyz', must be one of acquire, assess_uncertainty, "),
        (
            "diagnose",
            f"system, logs must be given: system=... logs=... {KEYS.replace('simulate', 'diagnose')}",
        ),
        ("simulate logs=a", f"system must be given: system=... {KEYS}"),
        ("simulate horizont=1", "unknown key 'horizont' of simulate; did you mean 'horizon'?"),
        ("simulate +horizont=1", "unknown key 'horizont'; did you mean 'horizon'?"),
        ("simulate ~horizont", "unknown key 'horizont' of simulate; did you mean 'horizon'?"),
        ("simulate ~horizon", "horizon: can be neither removed nor changed so: give horizon=..."),
        ("simulate model=hybrid", f"unknown key 'model' of simulate, must be one of {SIMULATE}"),
        ("simulate systems/pendulum.yaml", f"logs must be given: logs=... {KEYS}"),
        ("simulate systems/pendulum.yaml logs more", f"'more' is not key=value {KEYS}"),
        ("simulate =3", f"'=3' is not key=value {KEYS}"),
        ("simulate --horizon=3", "unknown option '--horizon=3'; did you mean 'horizon=3'?"),
        ("simulate --cfg", "argument --cfg/-c: expected one argument"),
        ("simulate logs=a(b", "'logs=a(b' cannot be read; as a text write \"logs='a(b'\""),
        ("simulate logs=80%§", "'logs=80%§' cannot be read; as a text write \"logs='80%§'\""),
        ("simulate logs=a=b", "'logs=a=b' cannot be read; as a text write \"logs='a=b'\""),
        (
            "simulate logs=a,b",
            "logs: commas separate the runs of a sweep (-m); as a text write \"logs='a,b'\"",
        ),
        (
            "acquire source=pendulum source.duration=1",
            "unknown key 'source.duration' of acquire, must be one of source.runs; "
            "what its config file leaves at the default is given as +source.duration=...",
        ),
        ("train modle=hybrid", "unknown key 'modle' of train; did you mean 'model'?"),
        ("train model.hiden=3", "unknown key 'model.hiden' of train; did you mean 'model.dynamics.hidden'?"),
        (
            "train model=hybird",
            "model=hybird: there is no such choice; did you mean 'hybrid'? Choices: best, ",
        ),
        ("train split=x", "split=x: there is no such choice. Choices: extrapolation, factors, "),
    ],
)
def test_a_mistyped_command_is_answered_in_one_line(
    words: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, (line,) = said(words.split(), capsys)
    assert code == 2
    assert line == f"error: {expected}" or (expected.endswith(", ") and line.startswith(f"error: {expected}"))


def test_what_is_proposed_for_an_odd_text_is_taken(capsys: pytest.CaptureFixture[str]) -> None:
    code, (line,) = said(["simulate", "system=none.yaml", "logs=it's 80%"], capsys)
    proposed = line.partition("as a text write ")[2]
    shell = subprocess.run(f"printf %s {proposed}", shell=True, capture_output=True, text=True).stdout
    code, (line,) = said(["simulate", "system=none.yaml", shell], capsys)
    assert (code, line) == (2, "error: none.yaml: no such file: check the path")


def test_several_mistyped_words_are_told_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    code, lines = said(["simulate", "none.yaml", "logs", "horizon", "only"], capsys)
    first, second = (f"'{word}' is not key=value {KEYS}" for word in ("horizon", "only"))
    assert code == 2 and lines == [f"error: {first} (1 more fault below)", f"also: {second}"]


@pytest.mark.parametrize("word", ["-V", "--version", "version"])
def test_the_version(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([word]) == 0
    assert capsys.readouterr().out.startswith("unmodelled 0.")


def test_help_of_a_verb_both_ways(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["help"]) == main(["--help"]) == 0
    first, second = capsys.readouterr().out.split("usage: ")[1:]
    assert first == second
    assert main(["help", "diagnose"]) == 0
    assert "_target_: unmodelled.cli.verbs.diagnose.diagnose" in capsys.readouterr().out


def test_all_faults_of_a_log_folder_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One line each, up to FAULTS of them, and nothing is written."""
    PendulumCampaign(runs=30, duration=0.3).write(tmp_path / "logs", 0)
    for number in range(1, 31):
        path = tmp_path / "logs" / f"run{number}.csv"
        path.write_text(path.read_text().replace("theta", "Theta"))
    arguments = [f"system={ROOT}/systems/pendulum.yaml", f"logs={tmp_path}/logs", f"out={tmp_path}/out"]
    code, lines = said(["simulate", *arguments], capsys)
    missing = "row 1: column theta is missing; there is 'Theta': rename it"
    assert code == 2
    assert lines == [
        f"error: {tmp_path}/logs/run1.csv: {missing} (29 more faults below)",
        *(f"also: {tmp_path}/logs/run{number}.csv: {missing}" for number in range(2, FAULTS + 1)),
        "... and 10 more",
    ]
    assert not (tmp_path / "out").exists()


def test_faults_are_collected_in_order_and_printable() -> None:
    faults = Faults()
    faults.check()
    for number in range(3):
        with faults.collected():
            raise BadInput(f"row {number}:\n\x1b[2J")
    with faults.collected():
        faults.check()
    with pytest.raises(BadInput, match="row 0") as refused:
        faults.check()
    assert refused.value.others[:2] == ("row 1: \\x1b[2J", "row 2: \\x1b[2J")
    assert refused.value.__notes__[0] == "also: row 1: \\x1b[2J"


@pytest.mark.long
def test_the_end_of_a_run_says_what_was_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    system = ROOT / "systems" / "pendulum.yaml"
    assert main(["acquire", "source=pendulum", "source.runs=2", "+source.duration=0.5", "out=logs"]) == 0
    assert capfd.readouterr().err == (
        "wrote logs: experiments.csv, provenance.json, run1.csv, run2.csv; read logs/experiments.csv; "
        "use it as logs=logs with a system file, or: python -m pipeline ingest raw=logs\n"
    )
    assert main(["simulate", f"system={system}", "logs=logs"]) == 0
    written_to = "outputs/simulate/last"
    assert capfd.readouterr().err == (
        f"wrote {written_to}: index.html, simulation.json, simulation.parquet; "
        f"open {written_to}/index.html; "
        f"the cause of the gap: python -m pipeline diagnose system={system} logs=logs\n"
    )
    assert main(["simulate", "-m", f"system={system}", "logs=logs", "hydra.sweep.dir=sweep"]) == 0
    printed = capfd.readouterr()
    assert printed.err.splitlines()[-1] == "wrote sweep; compare its runs: python -m pipeline compare sweep"
    assert "wrote" not in printed.err.partition("wrote sweep")[0] + printed.out


def test_only_what_is_new_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    out, reports = Path("out"), Path("reports")
    for path in (out / "tables" / "a.md", out / "index.html", out / ".marker", reports / "old.json"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x")
    os.utime(reports / "old.json", (0.0, 0.0))
    (reports / "claims.json").write_text("[]")
    arguments = {"out": tmp_path / "out", "reports": "reports", "seed": 0}
    since = time.time() - 60.0
    expected = "wrote out: index.html, tables/, reports: claims.json; open out/index.html"
    assert written("python -m pipeline", "pipeline.stages.site", arguments, since) == expected
    for number in range(9):
        (out / f"fig_{number}.svg").write_text("x")
    (out / "index.html").unlink()
    line = written("python -m pipeline", "pipeline.stages.draw", {"out": "out"}, since)
    shown = ", ".join(f"fig_{number}.svg" for number in range(6))
    assert line == f"wrote out: {shown} and 4 more; open out/fig_0.svg"
    assert written("python -m pipeline", "pipeline.stages.tune", {"out": tmp_path / "none"}, since) == ""


@pytest.mark.parametrize("verb", PROGRAM.verbs)
def test_the_next_step_names_arguments_of_its_verb(verb: str) -> None:
    module = import_module(PROGRAM.target(verb).rpartition(".")[0])
    known = set(inspect.signature(getattr(module, verb)).parameters)
    named = {name for _, name, _, _ in string.Formatter().parse(getattr(module, "NEXT", "")) if name}
    assert named <= {*known, "program"}
    assert known & {"out", "reports"}  # which say what every verb writes


def test_a_stage_of_the_graph_says_no_more_than_where_it_wrote(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DVC_STAGE", "dvc.yaml:acquire")
    monkeypatch.delenv("EXP_PROGRESS", raising=False)
    assert main(["acquire", "source=pendulum", "source.runs=1", "out=logs"]) == 0
    assert capsys.readouterr().err.splitlines() == ["wrote logs"]


def test_a_very_long_message_shows_its_start_and_its_end() -> None:
    line = str(BadInput("campaign.zip: damaged (" + "x" * 5000 + "): unpack it again"))
    assert len(line) < LONGEST and line.startswith("campaign.zip: damaged (x")
    assert " ... x" in line and line.endswith("x): unpack it again")


def test_a_full_memory_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from unmodelled.cli.verbs.simulate import simulate

    @functools.wraps(simulate)
    def full(**_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("unmodelled.cli.verbs.simulate.simulate", full)
    code, lines = said(["simulate", "system=systems/pendulum.yaml", "logs=systems", "out=c"], capsys)
    assert code == 2
    assert lines == ["error: the memory is used up: give fewer rows or experiments, or free some memory"]


@pytest.mark.parametrize("words", ["diagnose system=a.yaml", "diagnose system=a.yaml logs=b out=c"])
def test_missing_keys_and_files_are_refused_before_the_libraries_are_loaded(words: str) -> None:
    """They take seconds, a refusal half of one."""
    lines = [
        "import sys",
        "from unmodelled.__main__ import PROGRAM",
        "from unmodelled.cli.command_line import main",
        f"try: code = main(PROGRAM, {words.split()!r})",
        "except SystemExit as left: code = left.code",
        "print(code, sorted({'scipy', 'numba', 'sympy', 'pandas', 'matplotlib'} & set(sys.modules)))",
    ]
    ran = python("-c", "\n".join(lines))
    assert ran.stdout == "2 []\n" and len(ran.stderr.splitlines()) == 1


REFUSALS = """
import json, sys
from unmodelled.__main__ import PROGRAM
from unmodelled.cli.command_line import main
codes = []
for words in json.loads(sys.argv.pop()):
    try:
        codes.append(main(PROGRAM, words))
    except SystemExit as left:
        codes.append(left.code)
slow = {"numpy", "pandas", "scipy", "sympy", "numba", "matplotlib"} & set(sys.modules)
print(codes, sorted(slow))
"""


def test_what_is_given_is_checked_before_libraries_are_loaded(tmp_path: Path) -> None:
    """A refusal takes less than a second: 6 CPU seconds where scipy and numba are loaded first."""
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "thesis.tex").write_text("years of work")
    given = [f"system={ROOT}/systems/pendulum.yaml", f"logs={tmp_path}"]
    foreign, new = f"out={tmp_path}/thesis", f"out={tmp_path}/new"
    calls = [
        ["diagnose"],
        ["diagnose", "system=none.yaml", f"logs={tmp_path}", new],
        ["diagnose", *given, foreign],
        ["diagnose", *given, "horizon=abc", new],
        ["simulate", *given, foreign],
        ["identifiability", *given, "limit=x", new],
        ["plan", given[0], "limits=limits.yaml", foreign],
        ["report", f"answers={tmp_path}", f"out={tmp_path}/thesis/thesis.tex/list"],
        ["init", f"logs={tmp_path}", f"out={tmp_path}/thesis/thesis.tex/list"],
    ]
    found = python("-c", REFUSALS, json.dumps(calls))
    assert found.stdout == f"{[2] * len(calls)} []\n", found.stderr
