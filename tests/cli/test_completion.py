"""A shell completes verbs, keys, choices and paths, and asks the command itself for them."""

import shutil
import subprocess
from pathlib import Path

import pytest

from unmodelled.__main__ import PROGRAM
from unmodelled.cli.command_line import main
from unmodelled.cli.completion import SCRIPTS, candidates


@pytest.mark.parametrize(
    ("verb", "word", "found"),
    [
        ("diag", "", ["diagnose"]),
        ("co", "", ["compare", "completion"]),
        ("diagnose", "s", ["seed=", "system="]),
        ("diagnose", "--", ["--help", "--quiet", "--verbose"]),
        ("train", "model=h", ["model=hybrid"]),
        ("diagnose", "system=ma", ["system=machine.yaml"]),
        ("diagnose", "logs=", ["logs=logs/", "logs=machine.yaml"]),
        ("diagnose", "logs=logs/r", ["logs=logs/run 1.csv"]),
        ("diagnose", "mach", ["machine.yaml"]),  # bare words stand for keys
        ("diagnose", "logs=none/", []),
        ("diagnose", "logs=.h", ["logs=.hidden"]),
    ],
)
def test_words_that_may_stand_there(
    verb: str, word: str, found: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "logs").mkdir()
    for name in ("machine.yaml", "logs/run 1.csv", ".hidden"):
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    assert candidates(PROGRAM, verb, word) == found


def test_the_command_prints_scripts_and_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(PROGRAM, ["completion", "words", "simul", ""]) == 0
    assert capsys.readouterr().out == "simulate\n"
    assert main(PROGRAM, ["completion", "bash"]) == 0
    assert capsys.readouterr().out == SCRIPTS["bash"]
    assert main(PROGRAM, ["completion", "fish"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("error: completion: there is no shell 'fish', must be one of bash, zsh: ")
    assert 'eval "$(unmodelled completion bash)"' in told


COMPLETED = """
unmodelled() { if [[ $1 == completion && $2 == words ]]; then echo "$FOUND"; fi; }
eval "$SCRIPT"
COMP_LINE="unmodelled diagnose $WORD"; COMP_POINT=${#COMP_LINE}
COMP_WORDS=(unmodelled diagnose $SPLIT); COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
compopt() { :; }
_unmodelled
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    ("word", "split", "found", "reply"),
    [
        ("sy", "sy", "system=", ["system="]),
        ("system=ma", "system = ma", "system=machine.yaml", ["machine.yaml"]),  # bash parts words at =
        ("system=", "system =", "system=a.yaml\nsystem=b.yaml", ["a.yaml", "b.yaml"]),
    ],
)
def test_bash_replaces_the_part_that_it_has(word: str, split: str, found: str, reply: list[str]) -> None:
    variables = {"SCRIPT": SCRIPTS["bash"], "FOUND": found, "WORD": word, "SPLIT": split}
    ran = subprocess.run(["bash", "-c", COMPLETED], env=variables, capture_output=True, text=True, check=True)
    assert ran.stdout.split() == reply, ran.stderr
