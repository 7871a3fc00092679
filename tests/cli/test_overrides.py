"""A value on the command line is of the kind that its config file has."""

import os
from pathlib import Path
from typing import Any

import pytest

from tests.commands import exit_code
from unmodelled.base.errors import BadInput
from unmodelled.cli.overrides import check_kinds

WRITTEN: dict[str, Any] = {
    "seed": 0,
    "steps": 300,
    "rate": 0.01,
    "offset": -0.5,
    "spring": True,
    "kind": "single",
    "start": None,
    "runs": "???",
    "widths": [4, 8],
    "shares": [0.1, 0.5],
    "features": ["omega"],
    "identify": [],
    "fit": {"batch": 20},
}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"seed": 7, "steps": 1, "rate": 0, "offset": 3, "spring": False, "kind": 5},
        {"rate": 1, "start": [1], "runs": "anything", "widths": [1], "shares": [1, 0.01, 0.0]},
        {"features": [], "identify": ["m3", "J1"], "fit": {"batch": 1, "more": "of it"}},
    ],
)
def test_what_is_of_the_same_kind_is_taken(changes: dict[str, Any]) -> None:
    check_kinds(WRITTEN | changes, WRITTEN)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"seed": -1}, "seed: must be a whole number from 0 up, got '-1'"),
        ({"seed": 1.5}, "seed: must be a whole number, got '1.5'"),
        ({"seed": True}, "seed: must be a whole number, got 'True'"),
        ({"seed": None}, "seed: must be a whole number, got 'None'"),
        ({"seed": 10**30}, "seed: must be a whole number, finite and not that large"),
        ({"steps": 0}, "steps: must be a whole number from 1 up, got '0'"),
        ({"rate": float("nan")}, "rate: must be a number, finite"),
        ({"rate": float("inf")}, "rate: must be a number, finite"),
        ({"rate": -0.1}, "rate: must be a number from 0 up"),
        ({"rate": "fast"}, "rate: must be a number, got 'fast'"),
        ({"spring": 1}, "spring: must be true or false"),
        ({"kind": ["single"]}, "kind: must be a text"),
        ({"widths": 4}, r"widths: must be a list, \[...\], got '4'"),
        ({"widths": []}, "widths: must not be empty"),
        ({"widths": [4, 0]}, r"widths\[1\]: must be a whole number from 1 up, got '0'"),
        ({"shares": [0.5, "half"]}, r"shares\[1\]: must be a number, got 'half'"),
        ({"features": [["omega"]]}, r"features\[0\]: must be a text"),
        ({"fit": 3}, "fit: must be a mapping, got '3'"),
        ({"fit": {"batch": -2}}, "fit.batch: must be a whole number from 1 up"),
    ],
)
def test_anything_else_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(BadInput, match=words):
        check_kinds(WRITTEN | changes, WRITTEN)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (
            ["diagnose", "system=systems/pendulum.yaml", "logs=systems", "options=[]"],
            "options: must be a mapping, got '[]'",
        ),
        (
            ["diagnose", "system=systems/pendulum.yaml", "logs=systems", "options=5"],
            "options: must be a mapping, got '5'",
        ),
        (
            ["diagnose", "system=systems/pendulum.yaml", "logs=systems", "options=[level]"],
            "options: must be a mapping",
        ),
        (["train", "model={features: [1]}"], "model.features: must be a text"),
        (["simulate", "-m", "system=a", "logs=b", "hydra.sweeper._target_=x"], "hydra: Invalid plugin 'x'"),
        (["simulate", "-m", "system=a", "logs=b", "hydra.launcher=5"], "check the keys hydra.<...>"),
        (["init", "logs=a", "hydra.verbose={a: 1}"], "check the keys hydra.<...> of the command"),
        (["simulate", "~out", "system=a", "logs=b"], "out: can be neither removed nor changed so"),
        (["plan", "system=a", "hydra.mode=XYZ"], "hydra.mode=XYZ: Invalid value 'XYZ', expected one of [RUN"),
        (["export", "system=a", "hydra.job.chdir=[1]"], "hydra.job.chdir=[1]: "),
        (["export", "system={a: 1}", "out=b.fmu"], "system: must be the path of a file or folder, got"),
        (["simulate", "system=a", "logs=[b, c]", "out=d"], "logs: must be the path of a file or folder, got"),
        (["next", "+answer.a=1", "limits=a", "out=b"], "answer: must be the path of a file or folder, got"),
    ],
)
def test_what_is_no_mapping_and_no_plug_in_is_refused(
    command: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, said = exit_code(*command), capsys.readouterr().err
    assert code == 2 and said.startswith("error: ") and said.count("\n") == 1, said
    assert words in said


def test_a_working_folder_that_was_removed_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (gone := tmp_path / "gone").mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert exit_code("simulate", "system=/a", "logs=/b", "out=/tmp/c") == 2
    assert "the working folder was removed, change to another one" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["simulate", "diagnose", "next"])
def test_a_folder_that_nobody_may_enter_is_one_line(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As after chmod 000, which does not hold for root."""
    (locked := tmp_path / "locked").mkdir()
    seen = Path.stat

    def stat(path: Path, *, follow_symlinks: bool = True) -> os.stat_result:
        if locked in path.parents:
            raise PermissionError(13, "Permission denied", str(path))
        return seen(path, follow_symlinks=follow_symlinks)

    monkeypatch.setattr(Path, "stat", stat)
    keys = {"next": (f"answer={locked}", "limits=none")}.get(
        verb, ("system=systems/pendulum.yaml", f"logs={locked}")
    )
    assert exit_code(verb, *keys, f"out={tmp_path}/out") == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {locked}/") and "Permission denied: check its permissions" in said
    assert said.count("\n") == 1 and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("seed=abc", "seed: must be a whole number, got 'abc'"),
        ("profile.repeats=0", "profile.repeats: must be a whole number from 1 up"),
        ("~seed", "seed must be given: seed=..."),
        ("+model.foo=1", "unexpected keyword argument 'foo'"),
        ("profile=null", "Config group override must be a string"),
        ("hydra.run.dir=/proc/x", "/proc/x: No such file or directory"),
        ("out=/dev/null/x", "/dev/null: is a file"),
        ("seed=${nothing}", "nothing"),
    ],
)
def test_the_command_line_says_so_in_one_line(
    change: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code = exit_code("train", "model=f_h2", "model.features=nowhere", change)
    said = capsys.readouterr().err
    assert code == 2 and said.startswith("error: ") and said.count("\n") == 1, said
    assert words in said
