"""What is compiled is compiled again when something in its folder changes."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.compiling import PACKAGE

DECORATED = re.compile(r"^@(kept|compiled|jit|entry)\b", re.MULTILINE)

CALLER = """
import os
from pipeline import compiling
from pathlib import Path
compiling.PACKAGE = Path(__file__).parent
from inner import called
os.environ["NUMBA_NUM_THREADS"] = "1"
called(1.0)

@compiling.compiled
def twice(x):
    return 2.0 * called(x)

print(twice(3.0), sum(twice.stats.cache_hits.values()))
"""
CALLED = """
from pipeline.compiling import compiled

@compiled
def called(x):
    return x + {}
"""


def run(folder: Path) -> list[float]:
    """What the compiled functions say, and how often they were taken from disk."""
    done = subprocess.run(
        [sys.executable, "outer.py"],
        cwd=folder,
        env={"PYTHONPATH": str(PACKAGE.parent)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return [float(word) for word in done.stdout.split()]


def test_a_function_is_as_new_as_what_it_calls(tmp_path: Path) -> None:
    (tmp_path / "outer.py").write_text(CALLER)
    (tmp_path / "inner.py").write_text(CALLED.format("1.0"))
    assert run(tmp_path) == [8.0, 0.0]
    assert run(tmp_path) == [8.0, 1.0]
    (tmp_path / "inner.py").write_text(CALLED.format("2.0"))
    assert run(tmp_path) == [10.0, 0.0]
    assert run(tmp_path) == [10.0, 1.0]


def modules() -> list[str]:
    """Those with functions that are kept."""
    files = (path for path in PACKAGE.rglob("*.py") if DECORATED.search(path.read_text()))
    return sorted(".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts) for path in files)


@pytest.mark.parametrize("name", modules())
def test_compiled_functions_call_those_of_their_folder(name: str) -> None:
    values = vars(importlib.import_module(name)).values()
    folders = {value.py_func.__module__.rpartition(".")[0] for value in values if hasattr(value, "py_func")}
    assert folders <= {name.rpartition(".")[0]}


def test_nothing_is_kept_in_another_way() -> None:
    assert [p.name for p in PACKAGE.rglob("*.py") if "cache=True" in p.read_text()] == ["compiling.py"]
