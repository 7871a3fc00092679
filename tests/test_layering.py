"""Nouns never import verbs; layers import downwards only."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import grimp

from docs.reference.rooms import rooms

ROOT = Path(__file__).parents[1]
#: Pairs of rooms of which one may import the other, at most.
MOST_ARROWS = 50


def test_import_contracts() -> None:
    lint = Path(sys.executable).with_name("lint-imports")
    result = subprocess.run([lint], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 0, result.stdout


def imports() -> dict[str, set[str]]:
    """Modules that every module of the library imports, also in functions and for annotations alone."""
    graph = grimp.build_graph("unmodelled", cache_dir=None)
    return {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}


def test_no_modules_of_the_library_import_each_other() -> None:
    TopologicalSorter(imports()).prepare()  # raises CycleError, which names the modules


def test_every_room_says_in_three_lines_what_it_imports() -> None:
    found: dict[str, set[str]] = {}
    for module, imported in imports().items():
        room = module.split(".")[1:2]
        other = {each.split(".")[1] for each in imported if "." in each}
        found.setdefault("".join(room), set()).update(other.difference(room))
    said = {room.name: set(room.imports) for room in rooms()}
    assert said == {name: found[name] for name in found if name in said}
    assert set(found) - set(said) == {"", "__main__"}
    assert sum(map(len, said.values())) <= MOST_ARROWS
    for name in said:
        text = (ROOT / "unmodelled" / name / "__init__.py").read_text()
        assert sum(map(bool, text.removesuffix('"""\n').splitlines())) <= 3, name


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
