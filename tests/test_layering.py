"""Nouns never import verbs; layers import downwards only."""

from __future__ import annotations

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import grimp

ROOT = Path(__file__).parents[1]


def test_import_contracts() -> None:
    lint = Path(sys.executable).with_name("lint-imports")
    result = subprocess.run([lint], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout


def test_no_modules_of_the_library_import_each_other() -> None:
    """Imports in functions and for annotations alone count too."""
    graph = grimp.build_graph("unmodelled", cache_dir=None)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    TopologicalSorter(imports).prepare()  # raises CycleError, which names the modules


#: Calls that run what a text says.
FORBIDDEN = {"eval", "exec", "compile", "sympify", "parse_expr", "__import__", "unsafe_load", "full_load"}


def test_nothing_in_the_packages_evaluates_text() -> None:
    for path in (file for name in ("unmodelled", "pipeline") for file in (ROOT / name).rglob("*.py")):
        text = path.read_text()
        assert "pickle" not in text.replace("unpickle", "").replace("pickled", ""), path
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "id", getattr(node.func, "attr", ""))
                # of a network in evaluation mode, a regular expression, a compiled function, a robot
                harmless = {"model.eval", "re.compile", "compiled.compile", "spec.compile"}
                assert name not in FORBIDDEN or ast.unparse(node.func) in harmless, (path, node.lineno)
                if name == "load" and ast.unparse(node.func) == "torch.load":
                    assert any(k.arg == "weights_only" for k in node.keywords), (path, node.lineno)
