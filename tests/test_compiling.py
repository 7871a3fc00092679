"""What is compiled is compiled again when something in its room changes."""

import importlib
import os
import pickle
import re
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

import pipeline
import unmodelled
from tests.commands import python
from unmodelled.base import compiling, limits
from unmodelled.base.errors import BadInput

PACKAGES = [Path(str(package.__file__)).parent for package in (unmodelled, pipeline)]
ROOT = PACKAGES[0].parent
DECORATED = re.compile(r"^@(kept|compiled|jit|entry)\b", re.MULTILINE)

CALLER = """
import os
from unmodelled.base import compiling
from inner import called
os.environ["NUMBA_NUM_THREADS"] = "1"
called(1.0)

@compiling.compiled
def twice(x):
    return 2.0 * called(x)

print(twice(3.0), sum(twice.stats.cache_hits.values()))
"""
CALLED = """
from unmodelled.base.compiling import compiled

@compiled
def called(x):
    return x + {}
"""


def run(
    folder: Path, note: str = "", before: Callable[[], None] | None = None, **environment: str
) -> list[float]:
    """What the compiled functions say, and how often they were taken from disk."""
    how = {"cwd": folder, "env": {"PYTHONPATH": str(ROOT), **environment}, "preexec_fn": before}
    done = subprocess.run([sys.executable, "outer.py"], capture_output=True, text=True, **how)
    assert done.returncode == 0, done.stderr
    assert [note in line for line in done.stderr.splitlines()] == ([True] if note else []), done.stderr
    return [float(word) for word in done.stdout.split()]


@pytest.fixture
def program(tmp_path: Path) -> Path:
    folder = tmp_path / "program"
    folder.mkdir()
    (folder / "outer.py").write_text(CALLER)
    (folder / "inner.py").write_text(CALLED.format("1.0"))
    return folder


@pytest.mark.long
def test_a_folder_that_others_may_write_to_is_not_used(program: Path, tmp_path: Path) -> None:
    chosen = tmp_path / "chosen"
    assert run(program, NUMBA_CACHE_DIR=str(chosen)) == [8.0, 0.0]
    assert run(program, NUMBA_CACHE_DIR=str(chosen)) == [8.0, 1.0]
    assert chosen.stat().st_mode & 0o777 == 0o700
    chosen.chmod(0o770)
    # beside the program instead
    note = f"note: {chosen}: compiled functions are not cached there, because other users may write to it"
    assert run(program, note, NUMBA_CACHE_DIR=str(chosen)) == [8.0, 0.0]
    assert run(program, note, NUMBA_CACHE_DIR=str(chosen)) == [8.0, 1.0]


class Canary:
    """Runs a command where it is unpickled, as numba unpickles what it has kept."""

    def __init__(self, told: Path) -> None:
        self.told = told

    def __reduce__(self) -> tuple[object, ...]:
        return Path.touch, (self.told,)


def doubtful(kind: str, file: Path, elsewhere: Path) -> None:
    """Let others own or change a file, or what it stands for."""
    if kind == "mode":
        file.chmod(0o666)
    elif kind == "owner":
        os.chown(file, 65534, 65534)
    else:
        elsewhere.mkdir(mode=0o777)
        file.rename(elsewhere / file.name).chmod(0o600)
        file.symlink_to(elsewhere / file.name)


KINDS = [
    "mode",
    "link",
    pytest.param("owner", marks=pytest.mark.skipif(os.getuid() != 0, reason="only root gives files away")),
]


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_a_kept_function_that_others_could_have_changed_is_not_executed(
    kind: str, program: Path, tmp_path: Path
) -> None:
    chosen, told = tmp_path / "chosen", tmp_path / "told"
    assert run(program, NUMBA_CACHE_DIR=str(chosen)) == [8.0, 0.0]
    kept = sorted(chosen.rglob("*.nbi"))
    for file in kept:
        file.write_bytes(pickle.dumps(Canary(told)))
        doubtful(kind, file, tmp_path / f"elsewhere_{file.name}")
    note = f"note: {kept[0].parent}: compiled functions that others could have changed are removed"
    assert run(program, note, NUMBA_CACHE_DIR=str(chosen)) == [8.0, 0.0]
    assert not told.exists()
    assert run(program, NUMBA_CACHE_DIR=str(chosen)) == [8.0, 1.0]


@pytest.mark.long
def test_what_is_kept_stays_where_a_group_may_write_to_new_files(program: Path, tmp_path: Path) -> None:
    chosen = tmp_path / "chosen"

    def of_a_group() -> None:
        os.umask(0o002)

    for hits in (0.0, 1.0):
        found = run(program, before=of_a_group, NUMBA_CACHE_DIR=str(chosen))
        assert found == [8.0, hits]


@pytest.mark.long
def test_too_little_address_space_is_told_before_the_compiler_ends_the_process(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    taken = psutil.Process().memory_info().vms
    monkeypatch.setattr(limits.resource, "getrlimit", lambda _: (taken + 20_000_000, -1))
    with pytest.raises(BadInput, match=r"the limit on the address space .* raise the limit \(ulimit -v\)"):
        compiling.compiled(lambda x: 2.0 * x)(1.0)


def test_settings_in_the_working_folder_choose_no_folder_of_compiled_functions(tmp_path: Path) -> None:
    (tmp_path / ".numba_config.yaml").write_text(f"cache_dir: {tmp_path}\ndisable_jit: 1\n")
    code = "from unmodelled.base.compiling import numba as n; print(n.config.CACHE_DIR, n.config.DISABLE_JIT)"
    told = python("-c", code, cwd=tmp_path, PYTHONPATH=str(ROOT), NUMBA_CACHE_DIR=None).stdout
    assert told.split() == ["0"]


def test_beside_the_program_only_those_may_write_who_may_write_the_program(program: Path) -> None:
    assert run(program) == [8.0, 0.0]
    (program / "__pycache__").chmod(0o777)
    note = f"note: {program / '__pycache__'}: compiled functions are not cached there, because other users"
    assert run(program, note, XDG_CACHE_HOME=str(program / "home")) == [8.0, 0.0]
    program.chmod(0o777)
    assert run(program) == [8.0, 1.0]
    # who may not enter the one cannot write to the other
    program.chmod(0o700)
    assert run(program) == [8.0, 1.0]


def test_on_a_full_disk_nothing_is_kept(program: Path, tmp_path: Path) -> None:
    def no_room() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))

    note = f"note: {tmp_path}: compiled functions cannot be cached (File too large)"
    assert run(program, note, no_room, NUMBA_CACHE_DIR=str(tmp_path)) == [8.0, 0.0]
    assert run(program, NUMBA_CACHE_DIR=str(tmp_path)) == [8.0, 0.0]


@pytest.mark.long
def test_a_function_is_as_new_as_what_it_calls(program: Path) -> None:
    (program / "__init__.py").touch()
    assert [run(program), run(program)] == [[8.0, 0.0], [8.0, 1.0]]
    (program / "inner.py").write_text(CALLED.format("2.0"))
    assert [run(program), run(program)] == [[10.0, 0.0], [10.0, 1.0]]


def modules() -> list[str]:
    """Those with functions that are kept."""
    files = (path for package in PACKAGES for path in package.rglob("*.py"))
    found = (path.relative_to(ROOT) for path in files if DECORATED.search(path.read_text()))
    return sorted(".".join(path.with_suffix("").parts) for path in found)


def room(module: str) -> tuple[str, ...]:
    """Of a module: the package and the folder below it."""
    return tuple(module.split(".")[:2])


@pytest.mark.parametrize("name", modules())
def test_compiled_functions_call_those_of_their_room(name: str) -> None:
    values = vars(importlib.import_module(name)).values()
    rooms = {room(value.py_func.__module__) for value in values if hasattr(value, "py_func")}
    assert rooms <= {room(name)}


def test_nothing_is_kept_in_another_way() -> None:
    ways = re.compile(r"cache=True|enable_caching|\._cache\b")
    files = [path for package in PACKAGES for path in package.rglob("*.py")]
    assert [p.name for p in files if ways.search(p.read_text())] == ["compiling.py"]
