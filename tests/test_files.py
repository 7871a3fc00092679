"""Writing survives a full disk, a folder that cannot be written, two runs at once and kills at any moment."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pandas as pd
import pytest
import torch

from pipeline.rigs.pendulum import PendulumCampaign
from pipeline.stages.acquire import acquire
from tests.commands import ROOT, python
from tests.conftest import files_of
from unmodelled.base.errors import BadInput
from unmodelled.base.files import (
    copy_results,
    put_folder,
    read_json,
    replacing,
    replacing_folder,
    write_json,
    write_texts,
)
from unmodelled.base.markers import MARKER, RECORD
from unmodelled.base.parquet import write_parquet
from unmodelled.learning.checkpoint import write_checkpoint


def put(out: Path, who: str) -> None:
    """Write a folder with one file."""
    with replacing_folder(out) as folder:
        (folder / "who").write_text(who)


def test_a_verb_on_a_full_disk_says_so_and_leaves_the_old_result(tmp_path: Path) -> None:
    """The program can write 20 kB to a file and no more, as if the disk were full then."""
    out = tmp_path / "logs"
    acquire(PendulumCampaign(runs=1), 0, out)
    before = files_of(out)
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n"
    main = "import sys; from pipeline.__main__ import main; sys.exit(main(sys.argv[1:]))"
    result = python("-c", limit + main, "acquire", "source=pendulum", "seed=1", f"out={out}")
    assert result.returncode == 2
    assert result.stderr.startswith(f"error: {out}") and result.stderr.endswith("File too large\n")
    assert result.stderr.count("\n") == 1
    assert files_of(out) == before
    assert list(tmp_path.iterdir()) == [out]


ROWS = pd.DataFrame({"x": torch.randn(5000, dtype=torch.float64).numpy()})
WRITERS: dict[str, Callable[[Path], None]] = {
    "json": lambda path: write_json(path, list(range(20_000))),
    "checkpoint": lambda path: write_checkpoint(path, {"state": torch.zeros(5000)}),
}


@pytest.mark.parametrize("name", [*WRITERS, "parquet", "csv"])
def test_every_kind_of_file_on_a_full_disk(name: str, tmp_path: Path) -> None:
    """The limit is lifted again, for it holds for the whole process."""
    import resource

    def table(path: Path) -> None:
        with replacing(path) as temporary:
            ROWS.to_csv(temporary) if name == "csv" else write_parquet(ROWS, temporary)

    path = tmp_path / "result"
    path.write_text("old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, hard))
    try:
        with pytest.raises(BadInput, match=r"result: cannot be written: .*(File too large|errno 27)"):
            WRITERS.get(name, table)(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("writer", [replacing, replacing_folder])
@pytest.mark.parametrize(
    "where", ["file/out", "file/deep/out", "/proc/out", "x" * 300, "a\0b", ".", "/", ".."]
)
def test_where_nothing_can_be_written(
    writer: Callable[[Path], object], where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("mine")
    with pytest.raises(BadInput) as refused, writer(Path(where)) as temporary:  # type: ignore[attr-defined]
        temporary.write_text("")
    assert str(refused.value).isprintable()
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("file", "mine")]


def test_a_file_or_a_link_is_not_taken_for_a_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    for name, words in {"file": "is a file", "link": "is not a folder but a link"}.items():
        with pytest.raises(BadInput, match=f"{name}: .*{words}"), replacing_folder(tmp_path / name):
            pass
    assert (tmp_path / "file").read_text() == "mine" and (tmp_path / "link").is_symlink()
    assert {p.name for p in tmp_path.iterdir()} == {"file", "link", "real"}


def test_a_folder_that_cannot_take_its_place_leaves_the_old_one(tmp_path: Path) -> None:
    put(tmp_path / "out", "out")
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / "who").write_text("new")
    (tmp_path / "out" / RECORD).mkdir()
    (tmp_path / "out" / RECORD / "config.yaml").write_text("seed: 1")
    with pytest.raises(OSError):
        put_folder(tmp_path / "absent", tmp_path / "out")
    assert (tmp_path / "out" / "who").read_text() == "out"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["new", "out"]
    put_folder(tmp_path / "new", tmp_path / "out")
    assert (tmp_path / "out" / "who").read_text() == "new"
    assert (tmp_path / "out" / RECORD / "config.yaml").read_text() == "seed: 1"
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


@pytest.fixture
def _without_exchange(monkeypatch: pytest.MonkeyPatch) -> None:
    """A system that cannot exchange the names of two folders in one step."""
    monkeypatch.setattr("unmodelled.base.files.exchange", lambda one, other: False)


@pytest.mark.usefixtures("_without_exchange")
@pytest.mark.parametrize("moment", [0, 1, 2, 3])
def test_an_interruption_between_the_renames_loses_nothing(
    moment: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C while it is written, before the old folder goes, before the new one comes, and right after."""
    out, rename, calls = tmp_path / "out", Path.replace, []

    def interrupted(path: Path, target: Path) -> Path:
        calls.append(path)
        if len(calls) == moment:
            raise KeyboardInterrupt
        done = rename(path, target)
        if moment == 3 and len(calls) == 2:
            raise KeyboardInterrupt
        return done

    put(out, "old")
    with pytest.raises(KeyboardInterrupt), replacing_folder(out) as folder:
        (folder / "who").write_text("new")
        monkeypatch.setattr(Path, "replace", interrupted)
        if moment == 0:
            raise KeyboardInterrupt
    assert (out / "who").read_text() == ("new" if moment == 3 else "old")
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.skipif(sys.platform != "linux", reason="the system cannot exchange the names of two folders")
def test_a_kill_while_the_folder_is_put_in_its_place_leaves_one_of_the_two(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A kill is an exception here that no `finally` sees: the place holds a whole folder after every step."""
    out, rename, seen = tmp_path / "out", Path.replace, []

    def look(path: Path, target: Path) -> Path:
        seen.append((out / "who").read_text())
        done = rename(path, target)
        seen.append((out / "who").read_text())
        return done

    put(out, "old")
    monkeypatch.setattr(Path, "replace", look)
    put(out, "new")
    assert seen == ["new", "new"] and list(tmp_path.iterdir()) == [out]


@pytest.mark.usefixtures("_without_exchange")
def test_a_run_that_loses_the_place_removes_the_folder_it_moved_aside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The winner's own next folder is on its way in the same moment, so that the place is empty again."""
    out, rename, calls = tmp_path / "out", Path.replace, []

    def raced(path: Path, target: Path) -> Path:
        calls.append(path)
        if len(calls) == 2:
            rename(tmp_path / "winner", out)
        try:
            return rename(path, target)
        finally:
            if len(calls) == 3:
                rename(out, tmp_path / "winner")

    put(tmp_path / "winner", "winner")
    put(out, "old")
    monkeypatch.setattr(Path, "replace", raced)
    with pytest.raises(BadInput):
        put(out, "new")
    assert [p.name for p in tmp_path.iterdir()] == ["winner"]


@pytest.mark.usefixtures("_without_exchange")
def test_a_run_whose_folder_is_taken_at_once_removes_the_one_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another run moves the new folder aside in the same moment, to put its own there."""
    out, rename, calls = tmp_path / "out", Path.replace, []

    def raced(path: Path, target: Path) -> Path:
        calls.append(path)
        done = rename(path, target)
        if len(calls) == 2:
            rename(out, tmp_path / "taken")
        return done

    put(out, "old")
    monkeypatch.setattr(Path, "replace", raced)
    put(out, "new")
    assert [p.name for p in tmp_path.iterdir()] == ["taken"]
    assert (tmp_path / "taken" / "who").read_text() == "new"


#: Fills a folder for a long time.
LONG = """
import sys, time
from pathlib import Path
from unmodelled.base.files import replacing_folder
with replacing_folder(Path(sys.argv[1])) as folder:
    (folder / "large").write_text("half of it")
    print("at work", flush=True)
    time.sleep(100)
"""


@pytest.mark.parametrize("kind", ["result", "result.1.0123abcd.tmp", "[a-z]*"])
def test_the_next_run_removes_what_a_killed_one_left_and_nothing_else(kind: str, tmp_path: Path) -> None:
    out = tmp_path / kind
    with ExitStack() as stack:
        commands = ([sys.executable, "-c", LONG, str(path)] for path in (out, out, tmp_path / "other"))
        started = (subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE) for words in commands)
        killed, working, other = map(stack.enter_context, started)
        for process in (killed, working, other):
            stack.callback(process.kill)
            assert process.stdout is not None and process.stdout.readline() == b"at work\n"
        for process in (killed, other):
            process.kill()
            process.wait()
        put(out, "next")
        left = sorted(int(p.name.split(".")[-3]) for p in tmp_path.glob(".*.tmp"))
        assert left == sorted([working.pid, other.pid])
    put(out, "the one after")
    assert {p.name.split(".")[-3] for p in tmp_path.glob(".*.tmp")} == {str(other.pid)}


def test_a_folder_whose_files_are_not_listed_is_not_replaced(tmp_path: Path) -> None:
    """Verbs of older versions that wrote single files removed none: a user's may lie among them."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.txt").write_text("years of work")
    (out / MARKER).write_text('{"made_by": "a Python program"}')
    with pytest.raises(BadInput, match="which did not list its files: give another folder"):
        put(out, "new")
    assert (out / "thesis.txt").read_text() == "years of work"


def test_a_failing_run_removes_nothing_that_may_be_the_last_copy(tmp_path: Path) -> None:
    left = tmp_path / f".out.{2**22 + 1}.0123abcd.tmp"
    (left / "deep").mkdir(parents=True)
    with pytest.raises(BadInput), replacing_folder(tmp_path / "out"):
        raise BadInput("the logs are damaged")
    assert left.exists()


def test_the_number_of_a_container_names_another_process(tmp_path: Path) -> None:
    """The killed run had the same number as this one, as the first process of every container has."""
    left = tmp_path / f".out.{os.getpid()}.0123abcd.tmp"
    left.mkdir()
    put(tmp_path / "out", "next")
    assert not left.exists()


#: Writes a folder of twenty equal files and one file, again and again, with another number every time.
FOREVER = """
import sys
from itertools import count
from pathlib import Path
from unmodelled.base.files import replacing_folder, write_json
out, start = Path(sys.argv[1]), int(sys.argv[2])
for n in count(start, 2):
    write_json(out.with_name("file.json"), [n] * 1000)
    with replacing_folder(out) as folder:
        for k in range(20):
            (folder / str(k)).write_text(str(n))
"""


def written(folder: Path) -> tuple[set[str], set[int]]:
    """What the files of the folder hold, and the file beside it."""
    files = [p for p in (folder / "out").glob("*") if p.name != MARKER]
    texts = {p.read_text() for p in files}
    assert len(texts) <= 1 and len(files) in (0, 20)
    file = folder / "file.json"
    return texts, set(read_json(file)) if file.exists() else set()


def test_a_kill_at_any_moment_leaves_all_or_nothing(tmp_path: Path) -> None:
    """A hundred folders a second, and a kill that nobody can foresee."""
    for kill in range(12):
        command = [sys.executable, "-c", FOREVER, str(tmp_path / "out"), str(kill)]
        process = subprocess.Popen(command, cwd=ROOT)
        time.sleep(0.15 + 0.013 * kill)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        _, numbers = written(tmp_path)
        assert len(numbers) <= 1
    with replacing_folder(tmp_path / "out") as folder:
        for k in range(20):
            (folder / str(k)).write_text("last")
    assert written(tmp_path)[0] == {"last"}


def test_two_runs_at_once_never_mix(tmp_path: Path) -> None:
    """One may be refused in the moment in which the other takes the place, in one line."""
    once = FOREVER.replace("for n in count(start, 2):", "for n in range(start, start + 80, 2):")
    command = [sys.executable, "-c", once, str(tmp_path / "out")]
    runs = [
        subprocess.Popen([*command, str(start)], cwd=ROOT, stderr=subprocess.PIPE, text=True)
        for start in (0, 1)
    ]
    for process in runs:
        _, said = process.communicate()
        refused = f"{BadInput.__module__}.BadInput: "
        assert process.returncode == 0 or said.splitlines()[-1].startswith(refused), said
    texts, numbers = written(tmp_path)
    assert len(texts) == 1 and len(numbers) == 1
    assert {p.name for p in tmp_path.iterdir()} == {"out", "file.json"}


@pytest.mark.parametrize("listed", [True, False])
def test_results_of_a_stranger_are_copied_without_what_lies_elsewhere(tmp_path: Path, listed: bool) -> None:
    """A link to a file or a folder, a pipe, a hidden file, and a file that the verb did not list."""
    folder, secret = tmp_path / "theirs", tmp_path / "secrets" / "key"
    for file in (secret, folder / "tables" / "a.csv", folder / ".hidden"):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("1")
    (folder / "key").symlink_to(secret)
    (folder / "tables" / "keys").symlink_to(secret.parent)
    os.mkfifo(folder / "pipe")
    named = ["tables/a.csv", "key", "tables/keys/key", "tables/keys", "pipe", "../secrets/key", ".hidden"]
    if listed:
        (folder / MARKER).write_text(json.dumps({"made_by": "diagnose", "files": named}))
        (folder / "unlisted").write_text("1")
    copy_results(folder, tmp_path / "copy")
    assert files_of(tmp_path / "copy") == {"tables/a.csv": b"1"}


def test_of_files_that_belong_together_all_are_written_or_none(tmp_path: Path) -> None:
    """The second of three is too large, and nothing keeps the program from trying again."""
    import resource

    out, texts = tmp_path / "draft", {"mapping.yaml": "a", "system.yaml": 20_000 * "b", "arm.xml": "c"}
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, hard))
    try:
        with pytest.raises(BadInput, match=r"draft/system.yaml: cannot be written: File too large"):
            write_texts({out / name: text for name, text in texts.items()})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert files_of(tmp_path) == {}
    write_texts({out / name: text for name, text in texts.items()})
    assert {*files_of(out)} == {*texts}


def test_a_copy_to_a_full_disk_names_the_result(tmp_path: Path) -> None:
    (tmp_path / "made_elsewhere").write_text(1000 * "x")
    full = "machine.fmu: cannot be written: No space left on device"
    with pytest.raises(BadInput, match=full), replacing(tmp_path / "machine.fmu") as temporary:
        temporary.symlink_to("/dev/full")
        shutil.copyfile(tmp_path / "made_elsewhere", temporary)


def test_a_folder_that_is_copied_to_a_full_disk_is_one_line(tmp_path: Path) -> None:
    """As the errors of shutil, which name every file of a folder."""
    import resource

    for name in ("gap", "time"):
        (tmp_path / "made" / f"{name}.csv").parent.mkdir(exist_ok=True)
        (tmp_path / "made" / f"{name}.csv").write_text(20_000 * "x")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, hard))
    try:
        with pytest.raises(BadInput) as fault, replacing_folder(tmp_path / "answer") as new:
            shutil.copytree(tmp_path / "made", new, dirs_exist_ok=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert str(fault.value) == f"{tmp_path}/answer: cannot be written: File too large"


def test_a_sparse_file_among_results_is_refused_before_it_is_copied(tmp_path: Path) -> None:
    (tmp_path / "theirs").mkdir()
    with (tmp_path / "theirs" / "tables.csv").open("wb") as file:
        file.truncate(20 * 10**9)
    with pytest.raises(BadInput, match=r"tables\.csv: is too large"):
        copy_results(tmp_path / "theirs", tmp_path / "copy")
    assert files_of(tmp_path / "copy") == {}
