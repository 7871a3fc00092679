"""Measure the structure of the code and of the stage graph: python -m docs.structure [folder of a checkout].

The numbers of docs/decisions/0011-a-library-and-a-pipeline.md come from this program. Definitions:

- A line of code is a line that holds more than a comment or a part of a docstring.
- A room is a folder or a module directly below a package. An arrow is a pair of rooms of which one imports
  the other. The package's own `__init__` is no room: the one of the library names what users import.
- An ambiguous name is a public function or class that is defined in at least two modules. `main` is not
  counted, and neither is a verb, which is a module's function of the same name in a folder of verbs.
- An array function is a public function or method whose annotations name an array or a tensor. An override
  without a docstring has the docstring of the method that it overrides.
- Stages and their dependencies come from the committed `dvc.lock` files. A stage is stale after a change of
  a file if it depends on the file, on a folder above it, on a digest of code (data/digests) that changes, or
  on a result of a stale stage. The stage that writes the digests is not counted. Run `make report` before: a
  stage without a lock is missing in these counts.
"""

from __future__ import annotations

import ast
import json
import re
import shutil
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any

import grimp
import yaml

from docs.reference.docstrings import classes, docstring

PACKAGES = "unmodelled", "pipeline"
ARRAY = re.compile(r"Array|Tensor|ndarray")
#: "(samples, states)", "(windows,)" or "shape".
SHAPE = re.compile(r"\(\w[^()]*,[^()]*\)|shape|scalar")
DIGESTS = "data/digests"
CODE = re.compile(rf"(?:{'|'.join(PACKAGES)})(?:/|$)")


class Checkout:
    """A checkout of this repository, now or at an earlier commit; its packages need not be installed."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.packages = [name for name in PACKAGES if (root / name / "__init__.py").exists()]
        self.trees = {path: ast.parse(path.read_text()) for path in self._files(*self.packages)}
        sys.path.insert(0, str(root))
        self.graph = grimp.build_graph(*self.packages, cache_dir=None)

    def _files(self, *folders: str) -> list[Path]:
        return sorted(path for folder in folders for path in (self.root / folder).rglob("*.py"))

    def lines(self) -> dict[str, int]:
        """Return the number of lines of Python per top-level folder."""
        return {
            folder: sum(len(path.read_text().splitlines()) for path in self._files(folder))
            for folder in (*self.packages, "tests", "docs", "benchmarks")
        }

    def lines_of_code(self) -> dict[str, int]:
        """Return the number of lines of code per package: no blank lines, comments or docstrings."""
        return {
            package: sum(len(_code(path) - _docstrings(self.trees[path])) for path in self._files(package))
            for package in self.packages
        }

    def arrows(self) -> tuple[set[str], set[tuple[str, str]]]:
        """Return all rooms, and all pairs of rooms of which the first imports the second."""
        room = {module: ".".join(module.split(".")[:2]) for module in self.graph.modules}
        pairs = {(room[one], room[other]) for one, other in self._imports()}
        rooms = set(room.values()) - set(self.packages)
        return rooms, {(one, other) for one, other in pairs if one != other and {one, other} <= rooms}

    def wrong_way(self) -> int:
        """Return the number of imports of the pipeline by the library."""
        return sum(a.startswith("unmodelled") > b.startswith("unmodelled") for a, b in self._imports())

    def _imports(self) -> Iterator[tuple[str, str]]:
        for module in self.graph.modules:
            for imported in self.graph.find_modules_directly_imported_by(module):
                yield module, imported

    def single_use(self, folder: str) -> tuple[int, int]:
        """Return the number of modules below `folder`, and of those that exactly one other module imports."""
        prefix = f"{folder.replace('/', '.')}."
        modules = [m for m in self.graph.modules if m.startswith(prefix) and self._is_file(m)]
        users = Counter(len(self.graph.find_modules_that_directly_import(module)) for module in modules)
        return len(modules), users[1]

    def _is_file(self, module: str) -> bool:
        return (self.root / f"{module.replace('.', '/')}.py").exists()

    def ambiguous(self) -> list[str]:
        """Return the public names of functions and classes that several modules define."""
        defined = Counter(
            name
            for path, tree in self.trees.items()
            for name in {n.name for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}
            # a verb has the name of its module, in a folder of verbs
            if not (path.stem == name and path.parent.name in ("verbs", "stages"))
            if not name.startswith("_") and name != "main"
        )
        return sorted(name for name, times in defined.items() if times > 1)

    def constants(self, folder: str) -> int:
        """Return the number of numeric constants at the top level of the modules below `folder`."""
        trees = (tree for path, tree in self.trees.items() if path.is_relative_to(self.root / folder))
        return sum(_numbers(node) for tree in trees for node in tree.body)

    def docstrings(self, package: str) -> dict[str, int]:
        """Return counts of docstrings with examples, and of array functions without docstring or shape."""
        found: Counter[str] = Counter()
        known = classes(self.trees.values())
        for path in self._files(package):
            for node, owner in _public(self.trees[path]):
                text = docstring(node, owner, known)
                found["with an example"] += ">>>" in (ast.get_docstring(node) or "")
                if isinstance(node, ast.FunctionDef) and ARRAY.search(_annotations(node)):
                    found["array functions"] += 1
                    found["array functions without docstring"] += not text
                    found["array functions without shape"] += bool(text) and not SHAPE.search(text)
        return dict(found)

    def _graph(self, name: str) -> list[Path]:
        """Files of the stage graph; at 686b79f most of them stood in folders below `graph`."""
        return sorted([*self.root.glob(name), *self.root.glob(f"graph/*/{name}")])

    def stages(self) -> dict[str, tuple[set[str], set[str]]]:
        """Return the dependencies and results of every locked stage, as paths from the root."""
        found = {}
        for lock in self._graph("dvc.lock"):
            for name, stage in yaml.safe_load(lock.read_text())["stages"].items():
                deps, outs = ({entry["path"] for entry in stage.get(key, [])} for key in ("deps", "outs"))
                found[f"{lock.parent.name}:{name}"] = deps, outs
        return found

    def stale(self, changed: set[str]) -> int:
        """Return the number of stages that are stale after a change of some files, digests not counted."""
        stages = {name: stage for name, stage in self.stages().items() if DIGESTS not in stage[1]}
        stale: set[str] = set()
        while True:
            new = {n for n, (deps, _) in stages.items() if n not in stale and _touched(deps, changed)}
            if not new:
                return len(stale)
            stale |= new
            changed = changed | {out for name in new for out in stages[name][1]}

    def changed(self, file: str, line: str) -> set[str]:
        """Return what a stage notices of a line that is added to a file: the file, or digests of code.

        A new file is a copy of `viscous_friction.py` beside it, with the line.
        """
        if not (self.root / "pipeline/digests.py").exists():
            return {file}
        with TemporaryDirectory() as place:
            copy = Path(place)
            for name in (*self.packages, "conf"):
                shutil.copytree(self.root / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
            shutil.copy(self.root / "params.yaml", copy)
            before = _digests(copy)
            edited = copy / file
            model = edited if edited.exists() else edited.with_name("viscous_friction.py")
            edited.write_text(f"{model.read_text()}{line}\n")
            after = _digests(copy)
        return {name for name in before | after if before.get(name) != after.get(name)} | {file}

    def definitions(self) -> dict[str, dict[str, Any]]:
        """Return the stages as the `dvc.yaml` files define them."""
        files = [yaml.safe_load(path.read_text()) for path in self._graph("dvc.yaml")]
        return {name: stage.get("do", stage) for f in files for name, stage in f.get("stages", {}).items()}

    def unlocked(self) -> int:
        """Return the number of defined stages of which no cell is locked."""
        locked = {name.partition(":")[2].partition("@")[0] for name in self.stages()}
        return len(set(self.definitions()) - locked)

    def handwritten(self) -> int:
        """Return the number of dependencies on code that stand in `dvc.yaml` files."""
        deps = (dep for stage in self.definitions().values() for dep in stage.get("deps", []))
        return sum(bool(CODE.match(str(dep))) for dep in deps)


def _code(path: Path) -> set[int]:
    """Numbers of the lines of a file that hold more than a comment."""
    layout = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
    layout |= {tokenize.ENCODING, tokenize.ENDMARKER}
    with path.open("rb") as file:
        tokens = [token for token in tokenize.tokenize(file.readline) if token.type not in layout]
    return {line for token in tokens for line in range(token.start[0], token.end[0] + 1)}


def _docstrings(tree: ast.Module) -> set[int]:
    """Numbers of the lines that docstrings take."""
    lines = set[int]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            lines |= set(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    return lines


def _digests(folder: Path) -> dict[str, str]:
    """The digests of code that the stages of a checkout depend on, by their paths from its root."""
    subprocess.run([sys.executable, "-m", "pipeline.digests"], cwd=folder, env={}, check=True)
    files = (folder / DIGESTS).rglob("*.json")
    return {path.relative_to(folder).as_posix(): path.read_text() for path in files}


def _touched(deps: set[str], changed: set[str]) -> bool:
    """Whether a dependency is a changed path, or lies above or below one."""
    paths = [PurePosixPath(path) for path in changed]
    above = {str(parent) for path in paths for parent in (path, *path.parents)}
    below = {str(parent) for dep in deps for parent in PurePosixPath(dep).parents}
    return bool(deps & above or below & changed)


def _public(tree: ast.Module) -> Iterator[tuple[ast.FunctionDef | ast.ClassDef, ast.ClassDef | None]]:
    """Yield the public functions and classes with the class that each is defined in."""
    bodies: list[tuple[list[ast.stmt], ast.ClassDef | None]] = [(tree.body, None)]
    while bodies:
        body, owner = bodies.pop()
        for node in body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                yield node, owner
                if isinstance(node, ast.ClassDef):
                    bodies.append((node.body, node))


def _annotations(node: ast.FunctionDef) -> str:
    return f"{ast.unparse(node.args)} {ast.unparse(node.returns) if node.returns else ''}"


def _numbers(node: ast.stmt) -> int:
    """How many numeric constants a statement defines."""
    if isinstance(node, ast.AnnAssign) and node.value is not None:
        return int(_numeric(node.value))
    if not isinstance(node, ast.Assign):
        return 0
    target = node.targets[0]
    if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
        return sum(map(_numeric, node.value.elts))
    return int(_numeric(node.value))


def _numeric(value: ast.expr) -> bool:
    match value:
        case ast.Constant(value=bool()):
            return False
        case ast.Constant(value=int() | float()):
            return True
        case ast.UnaryOp(operand=inner):
            return _numeric(inner)
        case ast.BinOp(left=left, right=right):
            return _numeric(left) and _numeric(right)
        case ast.Tuple(elts=elements):
            return bool(elements) and all(map(_numeric, elements))
    return False


def measured(root: Path) -> dict[str, object]:
    """Return all measurements of a checkout, as plain values."""
    here = Checkout(root)
    library = here.packages[0]
    rooms, arrows = here.arrows()
    modules, used_once = here.single_use(f"{library}/diagnosis")
    laws = f"{library}/{'effects' if library == 'unmodelled' else 'physics/effects'}"
    edits = {
        "a new law": (f"{laws}/new_law.py", ""),
        "a comment in a law": (f"{laws}/coulomb_friction.py", "# comment"),
        "a comment in a style sheet": (f"{library}/report/static/style.css", "/* comment */"),
    }
    return {
        "lines of Python": here.lines(),
        "lines of code": here.lines_of_code(),
        "rooms": len(rooms),
        "arrows between rooms": len(arrows),
        "imports of the pipeline by the library": here.wrong_way() if len(here.packages) > 1 else None,
        "stages": len(here.stages()),
        "defined stages without a lock": here.unlocked(),
        "handwritten dependencies on code": here.handwritten(),
        "stale stages after a change": {
            what: here.stale(here.changed(*edit)) for what, edit in edits.items()
        },
        "modules in diagnosis": modules,
        "modules in diagnosis used by one other": used_once,
        "numeric constants in diagnosis": here.constants(f"{library}/diagnosis"),
        "ambiguous public names": len(here.ambiguous()),
        "docstrings": {package: here.docstrings(package) for package in here.packages},
    }


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    print(json.dumps(measured(folder), indent=2))
