"""A stage is run again when code that it runs has changed: all that it imports is among its dependencies."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import grimp
import pytest
import yaml

ROOT = Path(__file__).parents[2]
#: How files are written and what is said meanwhile: no result changes with it.
PLUMBING = {
    f"pipeline/{name}.py" for name in ("errors", "files", "parquet", "progress", "revision", "shapes")
}


def stages() -> dict[str, dict[str, Any]]:
    """All stages that run a verb."""
    found = {}
    for path in (ROOT / "dvc.yaml", *sorted(ROOT.glob("graph/*/dvc.yaml"))):
        found |= yaml.safe_load(path.read_text())["stages"]
    return {name: stage.get("do", stage) for name, stage in found.items()}


@cache
def imports() -> grimp.ImportGraph:
    """Of the package."""
    return grimp.build_graph("pipeline")


@pytest.mark.parametrize("name", stages())
def test_a_stage_depends_on_what_it_imports(name: str) -> None:
    stage = stages()[name]
    verb = re.search(r"-m pipeline (\w+)", stage["cmd"])
    assert verb, stage["cmd"]
    module = f"pipeline.stages.{verb[1]}"
    files = {f"{m.replace('.', '/')}.py" for m in {module, *imports().find_upstream_modules(module)}}
    run = {path for path in files if (ROOT / path).is_file()} - PLUMBING
    known = [str(d) for d in stage["deps"]]
    assert not {path for path in run if not any(path == d or path.startswith(f"{d}/") for d in known)}
