"""What `diagnose` refuses: exit code 2, one line that names file and place, and nothing is written.

Faults of system files are those of tests/physics/system/test_reader.py, of logs those of
tests/measurements/test_refusals.py, kinds of values those of tests/cli/test_overrides.py.
"""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.commands import exit_code
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.base.markers import MARKER
from unmodelled.diagnosis.answer import diagnose as story

Change = Callable[[Path], None]

SYSTEM = """\
schema: system/1
name: cart
states:
  x: {unit: m}
  v: {unit: m/s}
inputs:
  u: {unit: V, column: volts}
outputs:
  x: {unit: m, column: position}
operating_point:
  m: {unit: kg}
parameters:
  M: {value: 2.0, unit: kg}
  kf: {value: 1.5, unit: N/V}
  b: {value: 0.4, unit: N s/m, identify: true, bounds: [0, 5]}
ports:
  rail: {effort: F, unit: N, position: x, velocity: v}
dynamics:
  x: v
  v: (kf*u - b*v - F)/(M + m)
"""
PERIOD, SAMPLES = 0.01, 120


def log(k: int = 0, samples: int = SAMPLES, period: float = PERIOD) -> dict[str, Array]:
    """Something that a cart could do."""
    t = period * np.arange(samples)
    return {
        "t": t,
        "position": np.sin((2.0 + k) * t) + 1e-3 * np.cos(40.0 * t),
        "volts": 3.0 * np.cos(5.0 * t + k),
    }


def write_case(folder: Path) -> Path:
    """system.yaml and logs/ with three experiments."""
    logs = folder / "logs"
    logs.mkdir(parents=True)
    (folder / "system.yaml").write_text(SYSTEM)
    for k, name in enumerate("abc"):
        pd.DataFrame(log(k)).round(6).to_csv(logs / f"{name}.csv", index=False)
    (logs / "experiments.csv").write_text("id,file,m\na,a.csv,0.5\nb,b.csv,1.0\nc,c.csv,0.5\n")
    return folder


def system(old: str, new: str) -> Change:
    """Change the text of the system file."""
    assert SYSTEM.count(old) == 1, old
    return lambda folder: write(folder / "system.yaml", SYSTEM.replace(old, new))


def text(path: str, content: str | bytes) -> Change:
    """Replace a file."""
    return lambda folder: write(folder / path, content)


def write(path: Path, content: str | bytes) -> None:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())


def experiments(content: str) -> Change:
    return text("logs/experiments.csv", content)


def columns(**values: Array | str) -> Change:
    """Replace columns of the log of experiment b."""
    return lambda folder: pd.DataFrame({**log(1), **values}).to_csv(folder / "logs" / "b.csv", index=False)


def all_columns(samples: int = SAMPLES, period: float = PERIOD, **values: float) -> Change:
    """Write all three logs anew."""

    def change(folder: Path) -> None:
        for k, name in enumerate("abc"):
            made = pd.DataFrame({**log(k, samples, period), **values})
            made.to_csv(folder / "logs" / f"{name}.csv", index=False)

    return change


def nothing(folder: Path) -> None:
    """Leave the files as they are."""


HEAD = "id,file,m\n"

#: Arguments, and what the line says.
ARGUMENTS: list[tuple[list[str], str]] = [
    (["system=???"], r"system must be given"),
    (["logs=null"], r"logs must be given"),
    (["horizon=0"], r"horizon: must be a positive number of seconds, got 0"),
    (["horizon=soon"], r"horizon: must be a (positive )?number"),
    (["horizon=0.04"], r"horizon: 0\.04 s are 4 samples of 0\.01 s; 5 or more are needed"),
    (["system=nowhere.yaml"], r"nowhere\.yaml: no such file"),
    (["system=logs"], r"logs: no such file"),
    (["system=logs/a.csv"], r"logs/a\.csv: line 1: .*mapping"),
    (["logs=nowhere"], r"nowhere: no such folder"),
    (["logs=system.yaml"], r"system\.yaml: line 1: schema: must start with 'schema: mapping/1'"),
    (["logs=empty"], r"empty/experiments\.csv: no such file"),
    (["logs=" + "x" * 300], r"logs: File name too long"),
    (["out=logs"], "logs: is the input logs=logs"),
    (["out=system.yaml"], r"system\.yaml: is a file"),
    (["out=system.yaml/out"], r"system\.yaml: is a file, so that the folder .*out cannot be written"),
    (["out=."], r"'\.': is no valid name for a file or a folder"),
    (["out=.."], r"'\.\.': is no valid name for a file or a folder"),
    (["out=link"], "link: cannot be replaced: is not a folder but a link"),
    (["out=notes"], r"notes: holds 'todo\.txt' and has no file \.made_by, so that no verb made it"),
    (["out=" + "x" * 300], r"out: File name too long"),
]

#: Texts of the system file, what takes their places, and what the line says.
TEXTS = [
    ("kf*u - b*v", "kf*u - __import__(v)", r"line 20: dynamics\.v: '__import__' is not allowed"),
    (
        "{unit: kg}\nparam",
        "{unit: kg, values: {a: 1, b: 1, C: 1}}\nparam",
        r"logs/experiments\.csv: row 4: column id: the experiment 'c' is not in operating_point\.m\.values",
    ),
    ("column: volts", "column: voltage", r"logs/a\.csv: row 1: column voltage is missing"),
    ("column: volts", "column: volts, delay: 5", r"inputs\.u\.delay: 5 s is too long for experiment"),
    ("column: position", "column: position, delay: 5", r"system\.yaml: outputs: a delay must be short"),
    (
        "(kf*u - b*v - F)",
        "(kf*u + b*v*exp(min(1e4*v*v, 700))*1e200 - F)",
        r"system\.yaml: dynamics: the simulation diverges within [\d.]+ s from every measured state",
    ),
]
WITHOUT_PORTS = re.sub(r"ports:\n.*\n", "", SYSTEM).replace(" - F)", ")")
CHANGES: list[tuple[Change, str]] = [
    (text("system.yaml", b"\xff\xfe\x00"), r"system\.yaml: line 1: not UTF-8 text"),
    *((system(old, new), words) for old, new, words in TEXTS),
    (
        lambda folder: (experiments(HEAD + "a,a.csv,1\n")(folder), all_columns(samples=99)(folder)),
        r"experiments\.csv: column id: 1 experiment, too short to be cut into several; a diagnosis needs 2",
    ),
    (experiments(HEAD + "a,a.csv,1\nb\x1b[1m,b.csv,1\n"), r"row 3: column id: .* has a control character"),
    (experiments(HEAD + "a,a.csv,1\nb\0,b.csv,1\n"), r"experiments\.csv: (row 3: column id|not a table)"),
    (experiments("id,file,m,r\x07\na,a.csv,1,2\nb,b.csv,1,2\n"), r"row 1: column .* has a control charac"),
    (experiments("id,file,m,group\na,a.csv,1,x\nb,b.csv,1,\x9by\n"), r"row 3: column group: .* control"),
    (columns(position="NaN"), r"logs/b\.csv: row 2: column position: 'NaN' is not a finite number"),
    (all_columns(position=4095.0), r"logs/a\.csv: row 2: column position: dead output, 4095 in every row"),
    (
        columns(position=1e-200 * log()["t"]),
        r"logs/b\.csv: row 2: column position: its values differ by no more than",
    ),
]

CASES = [(nothing, arguments, words) for arguments, words in ARGUMENTS]
CASES += [(change, [], words) for change, words in CHANGES]


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's folder, where the command is given; a diagnosis that begins is noticed."""

    def begin(*_: object, **__: object) -> None:
        raise BadInput("the diagnosis has begun")

    monkeypatch.setattr(story, "diagnose_gap", begin)
    monkeypatch.chdir(write_case(tmp_path / "case"))
    (Path("notes") / "todo.txt").parent.mkdir()
    Path("notes/todo.txt").write_text("do not lose me")
    Path("empty").mkdir()
    Path("link").symlink_to("empty")
    return Path.cwd()


def refusal(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The line that is printed, before one for every further fault."""
    given = {a.split("=")[0] for a in arguments}
    plain = [f"{key}={value}" for key, value in DEFAULTS.items() if key not in given]
    code, said = exit_code("diagnose", *plain, *arguments), capsys.readouterr()
    assert (code, said.out) == (2, ""), said.err
    line, *others = said.err.splitlines()
    assert line.startswith("error: ") and said.err.endswith("\n")
    assert all(other.startswith("also: ") for other in others)
    assert not others or re.search(rf"\({len(others)} more faults? below\)$", line)
    return line


DEFAULTS = {"system": "system.yaml", "logs": "logs", "out": "out"}


def snapshot(folder: Path) -> dict[str, bytes]:
    return {
        p.relative_to(folder).as_posix(): p.read_bytes() if p.is_file() else b"" for p in folder.rglob("*")
    }


@pytest.mark.parametrize(("change", "arguments", "words"), CASES, ids=[words[-60:] for *_, words in CASES])
def test_refused_in_one_line(
    case: Path, capsys: pytest.CaptureFixture[str], change: Change, arguments: list[str], words: str
) -> None:
    change(case)
    before = snapshot(case)
    assert re.search(words, refusal(arguments, capsys))
    assert snapshot(case) == before
    assert sorted(p.name for p in case.parent.iterdir()) == ["case"]


#: What looks odd and is none the less something that can be diagnosed.
FINE: dict[str, tuple[Change, list[str]]] = {
    "as it is": (nothing, []),
    "inputs that never change": (all_columns(volts=0.0), []),
    "ten kilohertz": (all_columns(samples=2000, period=1e-4), []),
    "a horizon longer than every experiment": (nothing, ["horizon=100"]),
    "no port, but an uncertain parameter": (text("system.yaml", WITHOUT_PORTS), []),
    "neither port nor uncertain parameter": (
        text("system.yaml", WITHOUT_PORTS.replace(", identify: true", "")),
        [],
    ),
    "a simulation that diverges from some states only": (
        system("(kf*u - b*v - F)", "(kf*u - b*v - F + where(u > 2.9, 1e300*exp(700*abs(v)), 0))"),
        [],
    ),
    "a result of before": (text(f"result/{MARKER}", '{"made_by": "diagnose"}'), ["out=result"]),
}


@pytest.mark.parametrize("name", FINE)
def test_what_can_be_diagnosed(case: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    change, arguments = FINE[name]
    (case / "result").mkdir()
    change(case)
    assert refusal(arguments, capsys) == "error: the diagnosis has begun"
