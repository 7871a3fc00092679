"""Read docstrings from source files, without importing the modules."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from unmodelled.cli.program import full_docstring

ROOT = Path(__file__).parents[2]
HEADING = re.compile(r"^(Args|Attributes|Class attributes|Examples|Raises|Returns|Yields):$", re.M)
#: Base classes that document no method of a subclass.
PLAIN = {"object", "ABC", "Protocol", "Generic", "NamedTuple", "Enum", "Exception"}
#: Docstring of a method of a class that is not defined here, such as SymPy's Function.
FOREIGN = "Documented by another library."

Classes = dict[str, list[ast.ClassDef]]


@dataclass(frozen=True)
class Documented:
    """Docstring and parameters of a function or class."""

    text: str  # before the first section
    sections: dict[str, str]  # by heading
    parameters: dict[str, str]  # annotations of arguments of a function or fields of a dataclass, by name

    @property
    def first(self) -> str:
        """Return the first paragraph on one line."""
        return " ".join(self.text.split("\n\n")[0].split())

    def meanings(self) -> dict[str, str]:
        """Return the meaning of each parameter; one line may explain several parameters."""
        said = self.sections.get("Args") or self.sections.get("Attributes") or ""
        names = "|".join(map(re.escape, self.parameters))
        if not names:
            return {}
        # a name, or several with commas, at the start of a line or after the end of a sentence
        pattern = rf"(?:^\s*|(?<=\.) )((?:{names})(?:, (?:{names}))*): "
        parts = re.split(pattern, said, flags=re.M)
        found = {}
        for those, meaning in zip(parts[1::2], parts[2::2], strict=True):
            found |= dict.fromkeys(those.split(", "), " ".join(meaning.split()))
        return found


def of(target: str) -> Documented:
    """Return the docstring of a function or class by its dotted path, such as a `_target_`."""
    module, _, name = target.rpartition(".")
    path = ROOT / (module.replace(".", "/") + ".py")
    if not path.exists():  # what a package passes on
        return of(_passed_on(ROOT / module.replace(".", "/") / "__init__.py", name))
    nodes = {n.name: n for n in _tree(path).body if isinstance(n, ast.FunctionDef | ast.ClassDef)}
    return _documented(nodes[name])


def summary(path: Path) -> str:
    """Return the first line of a module's docstring."""
    return (ast.get_docstring(_tree(path)) or "").partition("\n")[0]


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


def _passed_on(path: Path, name: str) -> str:
    for node in _tree(path).body:
        if isinstance(node, ast.ImportFrom) and name in {alias.name for alias in node.names}:
            return f"{node.module}.{name}"
    raise KeyError(f"{path} has no {name}")


def _documented(node: ast.FunctionDef | ast.ClassDef) -> Documented:
    parts = HEADING.split(full_docstring(node))
    sections = {name: text.strip("\n") for name, text in zip(parts[1::2], parts[2::2], strict=True)}
    if isinstance(node, ast.FunctionDef):
        found = {a.arg: a.annotation for a in (*node.args.args, *node.args.kwonlyargs)}
    else:
        fields = [n for n in node.body if isinstance(n, ast.AnnAssign)]
        found = {ast.unparse(n.target): n.annotation for n in fields}
        inits = (n for n in node.body if isinstance(n, ast.FunctionDef) and n.name == "__init__")
        found |= {a.arg: a.annotation for init in inits for a in init.args.args if a.arg != "self"}
    parameters = {name: ast.unparse(a) if a is not None else "" for name, a in found.items()}
    return Documented(parts[0].strip(), sections, parameters)


def classes(trees: Iterable[ast.Module]) -> Classes:
    """Return the classes of some modules by name; several modules may use a name."""
    found: Classes = {}
    for tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, []).append(node)
    return found


def docstring(node: ast.FunctionDef | ast.ClassDef, owner: ast.ClassDef | None, known: Classes) -> str:
    """Return the docstring of a node, or for a method without one the docstring of the overridden method.

    It is empty if there is none, `FOREIGN` if the overridden method may be of another library.
    """
    own = ast.get_docstring(node) or ""
    if own or owner is None or isinstance(node, ast.ClassDef):
        return own
    names = [ast.unparse(base).split("[")[0] for base in owner.bases]
    for name in (each for each in names if each not in PLAIN):
        if name not in known:
            return FOREIGN
        for base in known[name]:
            methods = (n for n in base.body if isinstance(n, ast.FunctionDef) and n.name == node.name)
            if text := docstring(next(methods, node), base, known):
                return text
    return ""
