"""A stage is run again when code that it runs has changed: all that it imports is among its dependencies."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import grimp
import pytest

from pipeline.__main__ import PROGRAM
from tests.conftest import stages

ROOT = Path(__file__).parents[2]
#: How files are written and kept from being lost, compiled functions kept, workers started, and what is said
#: meanwhile: no result changes with it.
PLUMBING = {
    "pipeline/revision.py",
    *(
        f"unmodelled/base/{name}.py"
        for name in (
            "compiling",
            "errors",
            "files",
            "limits",
            "ownership",
            "parquet",
            "progress",
            "shapes",
            "workers",
        )
    ),
}


@cache
def imports() -> grimp.ImportGraph:
    """Of both packages."""
    return grimp.build_graph("unmodelled", "pipeline")


@pytest.mark.parametrize("name", stages())
def test_a_stage_depends_on_what_it_imports(name: str) -> None:
    stage = stages()[name]
    stage = stage.get("do", stage)
    verb = re.search(r"-m pipeline (\w+)", stage["cmd"])
    assert verb, stage["cmd"]
    module = PROGRAM.target(verb[1]).rpartition(".")[0]
    files = {f"{m.replace('.', '/')}.py" for m in {module, *imports().find_upstream_modules(module)}}
    run = {path for path in files if (ROOT / path).is_file()} - PLUMBING
    known = [str(d) for d in stage["deps"]]
    assert not {path for path in run if not any(path == d or path.startswith(f"{d}/") for d in known)}
