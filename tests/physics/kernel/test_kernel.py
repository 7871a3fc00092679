"""Kernels are generated once for every structure, and kept."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

from tests.physics.kernel.problems import one_state
from unmodelled.base.compiling import remove_doubtful
from unmodelled.base.errors import BadInput
from unmodelled.engine.compiled import compiled
from unmodelled.engine.compiled.compiled import cache_folders, kernel
from unmodelled.engine.compiled.structure import Augmented, Network
from unmodelled.systems.model import symbol
from unmodelled.systems.tables import Table

x, k, F = symbol("x"), symbol("k"), symbol("F")
DECAY = one_state(-k * x)
SYSTEM = DECAY.system


@pytest.fixture(autouse=True)
def _nothing_is_kept_in_memory() -> Iterator[None]:
    kernel.cache_clear()
    yield
    kernel.cache_clear()


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "chosen"
    monkeypatch.setenv("HYBRID_DYNAMICS_CACHE", str(folder))
    return folder


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where folders of the system's temporary files are made."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    return tmp_path / "temporary"


def files(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.glob("*.py")}


def test_a_structure_is_generated_once(cache: Path) -> None:
    kernel(DECAY)
    first = files(cache)
    assert len(first) == 1
    kernel.cache_clear()
    kernel(Augmented(SYSTEM.with_values({"k": 7.0}), (), ("k",)))
    assert files(cache) == first
    assert not list(cache.glob("*.tmp"))


def test_a_kept_kernel_is_not_generated_again(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel(DECAY)
    kernel.cache_clear()
    compiled._loaded.cache_clear()

    def refuse(model: Augmented) -> str:
        raise AssertionError("generated again")

    monkeypatch.setattr(compiled, "source", refuse)
    assert kernel(DECAY).layout.states == 1


TABLE = Table("curve", (0.0, 1.0, 2.0), (0.0, 1.0, 0.0))
OTHERS = {
    "dynamics": Augmented(replace(SYSTEM, dynamics=(-k * sp.sin(x) - F,)), (), ("k",)),
    "trained": Augmented(SYSTEM, (), ()),
    "law": Augmented(replace(SYSTEM, ports=(replace(SYSTEM.ports[0], law=0.1 * x),)), (), ("k",)),
    "network": Augmented(SYSTEM, (Network("end", (x,), 3),), ("k",)),
    "units": Augmented(SYSTEM, (Network("end", (x,), 4),), ("k",)),
    "input": Augmented(SYSTEM, (Network("end", (x**2,), 3),), ("k",)),
    "table": Augmented(replace(SYSTEM, tables=(TABLE,)), (), ("k",)),
    "points": Augmented(replace(SYSTEM, tables=(replace(TABLE, y=(0.0, 2.0, 0.0)),)), (), ("k",)),
    "kind": Augmented(replace(SYSTEM, tables=(replace(TABLE, kind="linear"),)), (), ("k",)),
}


def test_every_other_structure_has_another_name() -> None:
    names = {name: compiled._digest(model) for name, model in OTHERS.items()}
    assert len({compiled._digest(DECAY), *names.values()}) == len(OTHERS) + 1


@pytest.mark.parametrize("name", compiled._GENERATOR)
def test_a_new_generator_has_a_new_name(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for part in compiled._GENERATOR:
        copy = (tmp_path / "engine" / part).resolve()
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text((compiled._HERE / part).read_text())
    before = compiled._digest(DECAY)
    monkeypatch.setattr(compiled, "_HERE", tmp_path / "engine")
    assert compiled._digest(DECAY) == before
    changed = tmp_path / "engine" / name
    changed.write_text(changed.read_text() + "\n")
    assert compiled._digest(DECAY) != before


def test_folder_that_cannot_be_made_is_replaced(temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (temporary / "file").touch()
    monkeypatch.setenv("HYBRID_DYNAMICS_CACHE", str(temporary / "file" / "cache"))
    folder = next(cache_folders())
    assert folder.parent == temporary
    assert kernel(DECAY).layout.states == 1
    assert len(files(folder)) == 1


def test_folder_that_cannot_be_written_to_is_replaced(
    cache: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A superuser may write anywhere, so the system's answer is given here."""
    monkeypatch.setattr(compiled.os, "access", lambda path, mode: Path(path) != cache)
    assert next(cache_folders()).parent == temporary


def test_folder_that_others_may_write_to_is_replaced(
    cache: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What lies in the folder is imported."""
    note = f"note: {cache}: compiled functions are not cached there, because "
    kernel(DECAY)
    (planted,) = cache.glob("*.py")
    planted.write_text("raise AssertionError('was imported')")
    cache.chmod(0o777)
    kernel.cache_clear()
    compiled._loaded.cache_clear()
    assert kernel(DECAY).layout.states == 1
    assert f"{note}other users may write" in capsys.readouterr().err
    cache.chmod(0o700)
    monkeypatch.setattr("unmodelled.base.compiling.os.getuid", lambda: os.geteuid() + 1)
    (temporary / f"unmodelled-{os.geteuid() + 1}").mkdir()
    assert list(cache_folders()) == []
    assert f"{note}the folder belongs to" in capsys.readouterr().err


def test_a_file_that_others_may_change_is_made_again(cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kernel(DECAY)
    (planted,) = cache.glob("*.py")
    planted.write_text("raise AssertionError('was imported')")
    planted.chmod(0o666)
    for memory in (kernel, compiled._loaded, remove_doubtful):
        memory.cache_clear()
    assert kernel(DECAY).layout.states == 1
    assert "that others could have changed are removed" in capsys.readouterr().err
    assert planted.stat().st_mode & 0o777 == 0o600 and "was imported" not in planted.read_text()


@pytest.mark.usefixtures("temporary")
def test_a_full_disk_is_no_obstacle(
    cache: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    @contextmanager
    def full(path: Path) -> Iterator[Path]:
        yield path.with_name("temporary")
        raise BadInput(f"{path}: cannot be written: No space left on device")

    monkeypatch.setattr(compiled, "replacing", full)
    never_seen = Augmented(replace(SYSTEM, dynamics=(-k * x**5 - F,)), (), ("k",))
    assert kernel(never_seen).layout.states == 1
    assert not files(cache) and "No space left on device" in capsys.readouterr().err


def test_without_a_choice_the_users_cache_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HYBRID_DYNAMICS_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert next(cache_folders()) == tmp_path / "unmodelled"
