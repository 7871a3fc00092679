"""Odd values of every key on the command line: done, or refused in one line; never a fault."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from omegaconf import OmegaConf

from pipeline.__main__ import CONF, PROGRAM, main
from pipeline.rigs.pendulum import PendulumCampaign
from tests.fuzz.inputs import draws
from unmodelled.base.campaign import Campaign

VALUES = [
    *("abc", "''", "nan", "inf", "-inf", "-1", "-0.5", "0", "0.0", "1e999", "1000000000000", "1e-300", "1.5"),
    *("null", "true", "[]", "{}", "[1,2]", "[abc]", "[nan]", "[[]]", "{a: 1}", "[null]", "0x10", "1_0", "1"),
    *("'${x}'", "${oc.env:NOPE}", "${eval:1}", "${seed}", "a,b", "'a b'", "../x", "/dev/null", "'a\0b'", "é"),
    *("__import__('os')", "'!!python/name:os.system'", "'*a'", "[" * 50, "x" * 5000, "9**9**9**9"),
]
#: Runs that take a fraction of a second, on the files of `folder`.
RUNS = {
    "simulate": ["system=system.yaml", "logs=logs"],
    "identifiability": ["system=system.yaml", "logs=logs"],
    "ingest": ["system=system.yaml", "raw=logs"],
    "acquire": ["source=pendulum", "source.runs=1", "source.duration=0.3"],
    "train": ["model.features=features", "model=lls", "split=interpolation"],
    "tune": ["model.features=features", "model=f_h2", "hidden=4", "model.fit.steps=1", "profile.repeats=1"],
    "compare": ["runs=sweep"],
}


def keys(verb: str) -> list[str]:
    """Dotted names of all values that a run of `verb` reads."""
    choices = [change for change in RUNS[verb] if PROGRAM.is_choice(change)]
    config = PROGRAM.compose(verb, choices)
    return [name for name in _leaves(OmegaConf.to_container(config), "") if not name.endswith("_")]


def _leaves(node: Any, place: str) -> Iterator[str]:
    if isinstance(node, dict) and node:
        for name, inner in node.items():
            yield from _leaves(inner, f"{place}.{name}" if place else str(name))
    else:
        yield place


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, small_campaign: Campaign) -> Path:
    found = tmp_path_factory.mktemp("runs")
    shutil.copy(CONF.parent / "systems" / "pendulum.yaml", found / "system.yaml")
    PendulumCampaign(runs=2, duration=0.8).write(found / "logs", 0)
    small_campaign.write(found / "features")
    for number in (0, 1):
        run = found / "sweep" / str(number)
        (run / ".hydra").mkdir(parents=True)
        (run / ".hydra" / "overrides.yaml").write_text(f"[seed={number}]")
        (run / "fit.json").write_text(f'{{"loss": {number}}}')
    return found


@pytest.mark.long
@pytest.mark.parametrize("verb", RUNS)
def test_odd_values_are_used_or_refused(
    verb: str, folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    known = keys(verb)
    for draw in draws(0.2):
        with draw:
            changes = {name: draw.choice(VALUES) for name in draw.sample(known, draw.randint(1, 2))}
            kept = [change for change in RUNS[verb] if change.split("=")[0] not in changes]
            other = [f"{name}={value}" for name, value in changes.items() if name != "out"]
            code = _code([verb, *kept, *other, f"out=out_{verb}"])
            said = capfd.readouterr().err.splitlines()
            assert code in (0, 2), (changes, said)
            if code == 2:
                (line,) = (line for line in said if line.startswith("error: "))
                assert line.isprintable() and "Traceback" not in "".join(said), changes


@pytest.mark.parametrize("verb", RUNS)
def test_no_out_costs_a_file_of_a_user(
    verb: str, folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Any file, folder or new name in a folder of inputs, by any way to it."""
    monkeypatch.chdir(folder)
    (folder / "mine" / "deep").mkdir(parents=True, exist_ok=True)
    (folder / "mine" / "deep" / "thesis.txt").write_text("years of work")
    if not (folder / "link").is_symlink():
        (folder / "link").symlink_to(folder)
    names = ["system.yaml", "logs", "features", "sweep", "mine"]
    before = _files(folder, names)
    places = [folder / name for name in names] + [p for name in names for p in (folder / name).rglob("*")]
    for draw in draws(0.1):
        with draw:
            place = draw.choice(places).relative_to(folder) / draw.choice(["", "", "new", "..", "../new"])
            out = f"{draw.choice(['', './', 'link/', 'logs/../', f'{folder}/'])}{place}"
            code, said = _code([*RUNS[verb], f"out={out}"]), capfd.readouterr().err
            assert code in (0, 2) and "Traceback" not in said, (out, said)
            after = _files(folder, names)
            assert before.items() <= after.items(), out
            before = after


def _files(folder: Path, names: list[str]) -> dict[Path, bytes]:
    found = [p for name in names for p in (folder / name, *(folder / name).rglob("*")) if p.is_file()]
    return {path: path.read_bytes() for path in found}


def _code(arguments: list[str]) -> object:
    try:
        return main(arguments)
    except SystemExit as left:
        return left.code


CODE = [
    "+x={_target_: os.system, command: touch hacked}",
    "model.dynamics._target_=os.system",
    "model.features=${python:open('hacked','w')}",
    "seed='!!python/object/apply:os.system [touch hacked]'",
    "seed=__import__('os').system('touch hacked')",
]


@pytest.mark.parametrize("change", CODE)
def test_no_value_is_executed(
    change: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(folder)
    assert _code(["train", "model=f_h2", "model.features=features", "out=out", change]) == 2
    assert len(capfd.readouterr().err.splitlines()) == 1
    assert not (folder / "hacked").exists()
