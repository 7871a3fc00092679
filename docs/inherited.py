"""Find the docstring of a method that overrides a documented one, without importing the modules."""

from __future__ import annotations

import ast
from collections.abc import Iterable

#: Base classes that document no method of a subclass.
PLAIN = {"object", "ABC", "Protocol", "Generic", "NamedTuple", "Enum", "Exception"}
#: Docstring of a method of a class that is not defined here, such as SymPy's Function.
FOREIGN = "Documented by another library."

Classes = dict[str, list[ast.ClassDef]]


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
