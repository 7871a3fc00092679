"""Benchmarks are run by hand; that what they measure is still where they look for it is seen here."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

import benchmarks

FILES = sorted(Path(next(iter(benchmarks.__path__))).glob("[!_]*.py"))


# shap asks matplotlib for what will be removed
@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
@pytest.mark.parametrize("name", [path.stem for path in FILES])
def test_imports(name: str) -> None:
    import_module(f"benchmarks.{name}")
