"""No verb touches what it did not make: all verbs, their `out` and their inputs, found by themselves."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hydra.utils import get_method

from pipeline.__main__ import CONF, PROGRAM
from tests.commands import exit_code
from tests.conftest import files_of
from tests.every import check_each
from unmodelled.base.errors import BadInput
from unmodelled.base.markers import MARKER
from unmodelled.base.ownership import OUTPUTS, Out, OutputPlace, path_arguments

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


def writing(*outs: Out) -> list[str]:
    """Verbs that have an `out` (of one of these kinds); finding them imports all that they need."""
    every = [verb for verb in PROGRAM.verbs if "out" in paths(verb)]
    return [verb for verb in every if not outs or place(verb).out in outs]


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
    assert set(PROGRAM.verbs) - set(writing()) == {"tabulate_real", "tabulate_proposals"}
    assert all(isinstance(place(verb), OutputPlace) for verb in PROGRAM.verbs)
    assert {verb for verb in writing() if not inputs(verb)} == {"acquire", "example", "tune"}


@pytest.mark.long
def test_a_folder_that_no_verb_made_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def check(verb: str) -> None:
        folder = tmp_path / verb
        folder.mkdir()
        monkeypatch.chdir(folder)
        known, out = given(verb, folder), folder / "mine"
        (out / "deep").mkdir(parents=True)
        (out / "deep" / "thesis.txt").write_text("years of work")
        before = files_of(folder)
        code = exit_code(verb, *(f"{name}={path}" for name, path in known.items()), f"out={out}")
        after, said = files_of(folder), capsys.readouterr().err
        if place(verb).out is Out.SHARED:  # it takes the places of its own files there and no other
            assert before.items() <= after.items()
            return
        assert code == 2 and said.startswith(f"error: {out}: ") and said.count("\n") == 1, said
        assert place(verb).out is not Out.FOLDER or "no verb made it" in said, said
        assert after == before

    check_each(writing(), check)


def test_what_another_verb_made_is_refused(tmp_path: Path) -> None:
    def check(verb: str) -> None:
        known, out = given(verb, tmp_path / verb), tmp_path / verb / "answer"
        out.mkdir(parents=True)
        (out / "diagnosis.json").write_text("{}")
        (out / MARKER).write_text('{"files": ["diagnosis.json"], "made_by": "another"}')
        before = files_of(tmp_path / verb)
        told = "made by another, not by .*give another folder, or remove this one yourself"
        with pytest.raises(BadInput, match=told):
            call(verb, known, out)
        assert files_of(tmp_path / verb) == before

    check_each(writing(Out.FOLDER), check)


@pytest.mark.parametrize("relation", ["is", "lies inside", "holds"])
def test_an_out_at_an_input_is_refused(relation: str, tmp_path: Path) -> None:
    cases = [(verb, name) for verb in writing() for name in inputs(verb) if _refused(verb, name, relation)]
    check_each(cases, lambda case: _check_out_at_input(*case, relation, tmp_path / "-".join(case)))


def _refused(verb: str, name: str, relation: str) -> bool:
    """Whether this is no folder of many results, of files of a user or of several verbs."""
    about = place(verb)
    return not (
        (relation == "lies inside" and name in about.inside)
        or (relation == "is" and name in about.beside)
        or (relation == "holds" and about.out is Out.SHARED)
    )


def _check_out_at_input(verb: str, name: str, relation: str, folder: Path) -> None:
    known, about = given(verb, folder), place(verb)
    source = known[name]
    out = {"is": source, "lies inside": source / "new" / "out", "holds": source.parent}[relation]
    own = '{"files": ["folder/precious.txt", "precious.txt"], "made_by": "' + verb + '"}'
    if out.exists() and about.out is Out.FOLDER:
        (out / MARKER).write_text(own)  # even a folder that the verb made itself
    before = files_of(folder)
    with pytest.raises(BadInput) as refused:
        call(verb, known, out)
    if about.out is not Out.FILE:  # of a file, a folder of its name is wrong in any case
        assert f"{out}: {relation} the input {name}=" in str(refused.value)
    assert files_of(folder) == before


@pytest.mark.long
def test_the_command_line_says_so_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Through a link, and by a relative name with detours."""

    def check(verb: str) -> None:
        folder = tmp_path / verb
        known = given(verb, folder)
        monkeypatch.chdir(folder)
        (folder / "link").symlink_to(folder / "in")
        name = inputs(verb)[0]
        before = files_of(folder)
        for out in (f"link/{name}/folder", f"in/../in/{name}/folder"):
            code = exit_code(verb, *(f"{key}={path}" for key, path in known.items()), f"out={out}")
            said = capsys.readouterr().err
            assert code == 2 and said.startswith("error: ") and said.count("\n") == 1, said
        assert files_of(folder) == before

    check_each([verb for verb in writing() if inputs(verb)], check)


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
    assert exit_code("acquire", *TWICE["acquire"], "out=logs") == 0
    for verb, arguments in TWICE.items():
        assert exit_code(verb, *arguments, f"out={verb}") == 0
        first = files_of(tmp_path / verb)
        assert exit_code(verb, *arguments, f"out={verb}") == 0, capsys.readouterr().err
        assert files_of(tmp_path / verb) == first and f'"made_by": "{verb}"' in first[MARKER].decode()


def test_a_file_that_a_user_put_into_a_result_is_not_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert exit_code("acquire", *TWICE["acquire"], "out=logs") == 0
    (tmp_path / "logs" / "notes").mkdir()
    (tmp_path / "logs" / "notes" / "day.txt").write_text("it was warm")
    before = files_of(tmp_path)
    assert exit_code("acquire", *TWICE["acquire"], "out=logs") == 2
    assert "'notes/day.txt', which acquire did not write" in capsys.readouterr().err
    assert files_of(tmp_path) == before
