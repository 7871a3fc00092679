"""No verb touches what it did not make: all verbs, their `out` and their inputs, found by themselves."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hydra.utils import get_method

from pipeline.__main__ import CONF, PROGRAM, main
from unmodelled.base.errors import BadInput
from unmodelled.base.ownership import MARKER, OUTPUTS, Out, OutputPlace, path_arguments

Stage = Callable[..., object]


def stage(verb: str) -> Stage:
    found: Stage = get_method(PROGRAM.target(verb))
    return found


def place(verb: str) -> OutputPlace:
    found = stage(verb).__dict__["place"]
    assert isinstance(found, OutputPlace)
    return found


def paths(verb: str) -> list[str]:
    return path_arguments(inspect.signature(stage(verb)).parameters)


def inputs(verb: str) -> list[str]:
    return [name for name in paths(verb) if name not in OUTPUTS]


WRITING = [verb for verb in PROGRAM.verbs if "out" in paths(verb)]
WITH_INPUTS = [(verb, name) for verb in WRITING for name in inputs(verb)]


def run(*arguments: str) -> object:
    try:
        return main(list(arguments))
    except SystemExit as left:
        return left.code


def everything(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def given(verb: str, folder: Path) -> dict[str, Path]:
    """A folder with a file for every input of `verb`."""
    found = {name: folder / "in" / name / "folder" for name in inputs(verb)}
    for path in found.values():
        path.mkdir(parents=True)
        (path / "precious.txt").write_text("mine")
    return found


def call(verb: str, known: dict[str, Path], out: Path) -> None:
    arguments: dict[str, Any] = dict.fromkeys(inspect.signature(stage(verb)).parameters)
    stage(verb)(**arguments | known | {"out": out})


def test_every_verb_but_those_without_an_out_is_looked_at() -> None:
    assert set(PROGRAM.verbs) - set(WRITING) == {"tabulate_real", "tabulate_proposals"}
    assert all(isinstance(place(verb), OutputPlace) for verb in PROGRAM.verbs)
    assert {verb for verb in WRITING if not inputs(verb)} == {"acquire", "tune"}


@pytest.mark.long
@pytest.mark.parametrize("verb", WRITING)
def test_a_folder_that_no_verb_made_is_refused(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    known, out = given(verb, tmp_path), tmp_path / "mine"
    (out / "deep").mkdir(parents=True)
    (out / "deep" / "thesis.txt").write_text("years of work")
    before = everything(tmp_path)
    code = run(verb, *(f"{name}={path}" for name, path in known.items()), f"out={out}")
    after = everything(tmp_path)
    if place(verb).out is Out.SHARED:  # it takes the places of its own files there and no other
        assert before.items() <= after.items()
        return
    said = capsys.readouterr().err
    assert code == 2 and said.startswith(f"error: {out}: ") and said.count("\n") == 1, said
    assert after == before


@pytest.mark.parametrize("verb", [v for v in WRITING if place(v).out is Out.FOLDER])
@pytest.mark.parametrize("maker", ["another", None])
def test_what_another_verb_or_an_older_program_made_is_refused(
    verb: str, maker: str | None, tmp_path: Path
) -> None:
    known, out = given(verb, tmp_path), tmp_path / "answer"
    out.mkdir()
    (out / "diagnosis.json").write_text("{}")
    if maker:
        (out / MARKER).write_text('{"files": ["diagnosis.json"], "made_by": "another"}')
    before = everything(tmp_path)
    with pytest.raises(BadInput, match="made by another, not by" if maker else "no verb made it") as refused:
        call(verb, known, out)
    assert "give another folder, or remove this one yourself" in str(refused.value)
    assert everything(tmp_path) == before


@pytest.mark.parametrize("relation", ["is", "lies inside", "holds"])
@pytest.mark.parametrize(("verb", "name"), WITH_INPUTS)
def test_an_out_at_an_input_is_refused(verb: str, name: str, relation: str, tmp_path: Path) -> None:
    known, about = given(verb, tmp_path), place(verb)
    if relation == "lies inside" and name in about.inside:
        pytest.skip("a folder of many results, with places for new ones")
    if relation == "is" and name in about.beside:
        pytest.skip("a folder of a user's files, into which new files are put")
    if relation == "holds" and about.out is Out.SHARED:
        pytest.skip("a shared folder, nothing but own files are replaced")
    source = known[name]
    out = {"is": source, "lies inside": source / "new" / "out", "holds": source.parent}[relation]
    own = '{"files": ["folder/precious.txt", "precious.txt"], "made_by": "' + verb + '"}'
    if out.exists() and about.out is Out.FOLDER:
        (out / MARKER).write_text(own)  # even a folder that the verb made itself
    before = everything(tmp_path)
    with pytest.raises(BadInput) as refused:
        call(verb, known, out)
    if about.out is not Out.FILE:  # of a file, a folder of its name is wrong in any case
        assert f"{out}: {relation} the input {name}=" in str(refused.value)
    assert everything(tmp_path) == before


@pytest.mark.long
@pytest.mark.parametrize("verb", [v for v in WRITING if inputs(v)])
def test_the_command_line_says_so_in_one_line(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Through a link, and by a relative name with detours."""
    monkeypatch.chdir(tmp_path)
    known = given(verb, tmp_path)
    (tmp_path / "link").symlink_to(tmp_path / "in")
    name = inputs(verb)[0]
    before = everything(tmp_path)
    for out in (f"link/{name}/folder", f"in/../in/{name}/folder"):
        code = run(verb, *(f"{key}={path}" for key, path in known.items()), f"out={out}")
        said = capsys.readouterr().err
        assert code == 2 and said.startswith("error: ") and said.count("\n") == 1, said
    assert everything(tmp_path) == before


SYSTEM = f"system={CONF.parent / 'systems' / 'pendulum.yaml'}"
#: What replaces its folder, and what adds to it.
TWICE = {
    "acquire": ["source=pendulum", "source.runs=2"],
    "ingest": [SYSTEM, "raw=logs"],
    "simulate": [SYSTEM, "logs=logs"],
    "identifiability": [SYSTEM, "logs=logs"],
}


@pytest.mark.long
def test_what_the_same_verb_made_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("acquire", *TWICE["acquire"], "out=logs") == 0
    for verb, arguments in TWICE.items():
        assert run(verb, *arguments, f"out={verb}") == 0
        first = everything(tmp_path / verb)
        assert run(verb, *arguments, f"out={verb}") == 0, capsys.readouterr().err
        assert everything(tmp_path / verb) == first and f'"made_by": "{verb}"' in first[MARKER].decode()


def test_a_file_that_a_user_put_into_a_result_is_not_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("acquire", *TWICE["acquire"], "out=logs") == 0
    (tmp_path / "logs" / "notes").mkdir()
    (tmp_path / "logs" / "notes" / "day.txt").write_text("it was warm")
    before = everything(tmp_path)
    assert run("acquire", *TWICE["acquire"], "out=logs") == 2
    assert "'notes/day.txt', which acquire did not write" in capsys.readouterr().err
    assert everything(tmp_path) == before
