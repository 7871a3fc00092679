"""Digests of the code and configuration that each stage depends on: python -m pipeline.digests

The stage `code` of dvc.yaml writes them, every other stage depends on some of them:

    data/digests/<verb>.json          its config file and all code that the verb imports
    data/digests/<group>/<name>.json  a config file that a key chooses, what it is built on, the code it names
    data/digests/lists/<key>.json     a list of params.yaml, with the config files that it names

`keys` of params.yaml are part of the verb, or of the config file, that they change (`pipeline/keys.py`).
Comments and docstrings are not part of a digest, and neither is the layout of a file.
"""

import ast
import hashlib
import json
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from pipeline.__main__ import PROGRAM
from pipeline.keys import FILE, check_keys, read_keys
from unmodelled.base.errors import BadInput
from unmodelled.cli.refusal import refuse

#: Packages whose modules are followed.
PACKAGES = ("unmodelled", "pipeline")
#: Folders of config files; of two with the same name one verb may read the one and another verb the other.
CONF = (Path("conf"), Path("unmodelled/conf"))
OUT = Path("data/digests")
#: In packages of this name a docstring is the caption of a figure, and part of the digest.
CAPTIONED = "figures"

Digests = dict[str, str]


@cache
def source(module: str) -> Path | None:
    """Return the file of a module or package of `PACKAGES`."""
    if module.partition(".")[0] not in PACKAGES:
        return None
    path = Path(*module.split("."))
    found = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in found if file.is_file()), None)


@cache
def tree(module: str) -> ast.Module:
    """Parse a module."""
    file = source(module)
    assert file is not None, module
    return _parsed(file.read_bytes(), str(file))


@cache
def _parsed(text: bytes, name: str) -> ast.Module:
    return ast.parse(text, name)


def _is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING")


def _statements(node: ast.AST, functions: bool) -> Iterator[ast.AST]:
    """Yield the statements below a node that are executed, those within functions only if `functions`."""
    for child in ast.iter_child_nodes(node):
        if _is_type_checking(child):
            assert isinstance(child, ast.If)
            yield from (inner for other in child.orelse for inner in (other, *_statements(other, functions)))
        elif isinstance(child, ast.stmt | ast.excepthandler | ast.match_case) and (
            functions or not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef)
        ):
            yield child
            yield from _statements(child, functions)


@cache
def imported(module: str) -> frozenset[str]:
    """Return the modules of `PACKAGES` that a module imports, also within its functions.

    Imports within functions of a package's `__init__` are not followed: these functions serve users of the
    package, and modules of this program import from modules. A module that uses pkgutil imports all other
    modules of its package.
    """
    file = source(module)
    assert file is not None, module
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    names = set[str]()
    for node in _statements(tree(module), functions=file.name != "__init__.py"):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parent = ".".join(package.split(".")[: len(package.split(".")) - node.level + 1])
            base = ".".join(filter(None, (parent if node.level else "", node.module)))
            names |= {base, *(f"{base}.{alias.name}" for alias in node.names)}
    if "pkgutil" in names:
        names |= {f"{package}.{path.stem}" for path in file.parent.glob("*.py") if path.name != "__init__.py"}
    return frozenset(name for name in names if source(name))


def closure(modules: Iterable[str]) -> list[str]:
    """Return modules with all their direct and indirect imports and the packages around them, sorted."""
    found, left = set[str](), {module for module in modules if source(module)}
    while left:
        module = left.pop()
        found.add(module)
        around = module.rpartition(".")[0]
        left |= {*imported(module), *([around] if around else [])} - found
    return sorted(found)


@cache
def code_digest(module: str) -> str:
    """Digest the syntax tree of a module without its docstrings."""
    return _tree_digest(tree(module), CAPTIONED in module.split("."))


@cache
def _tree_digest(nodes: ast.Module, captioned: bool) -> str:
    if not captioned:
        for node in ast.walk(nodes):
            body = getattr(node, "body", None)
            if isinstance(body, list):
                node.body = [part for part in body if not _is_text(part)] or [ast.Pass()]  # type: ignore[attr-defined]
    return _digest(ast.dump(nodes).encode())


def _is_text(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


@cache
def data_files(module: str) -> tuple[Path, ...]:
    """Return what a module may read: if it names `__file__`, all files beside it but Python files."""
    file = source(module)
    assert file is not None, module
    if b"__file__" not in file.read_bytes():
        return ()
    folders = [d for d in file.parent.iterdir() if d.is_dir() and not any(d.glob("*.py"))]
    found = [file.parent.glob("*"), *(d.rglob("*") for d in folders if d.name != "__pycache__")]
    return tuple(sorted(path for paths in found for path in paths if path.is_file() and path.suffix != ".py"))


def of_code(modules: Iterable[str]) -> Digests:
    """Digest all code and data that some modules use."""
    found = closure(modules)
    data = {str(path): _digest(path.read_bytes()) for module in found for path in data_files(module)}
    return {**{module: code_digest(module) for module in found}, **data}


@cache
def configuration(file: Path) -> Any:
    """Read a configuration file."""
    return yaml.safe_load(file.read_bytes()) or {}


def config_files(pattern: str) -> Iterator[Path]:
    """Yield the configuration files that match a pattern."""
    for folder in CONF:
        yield from folder.glob(pattern)


def built_on(group: str, name: str) -> Iterator[Path]:
    """Yield the configuration files of a choice, and those of its `defaults`."""
    for file in config_files(f"{group}/{name}.yaml"):
        yield file
        for entry in configuration(file).get("defaults", []):
            # "name@package" of the same group, or a group, "/group@package", with a name
            given = entry if isinstance(entry, dict) else {group: entry}
            for key, value in given.items():
                if value != "_self_":
                    yield from built_on(key.split("@")[0].lstrip("/"), str(value).split("@")[0])


def targets(node: Any) -> Iterator[str]:
    """Yield the modules of the functions and classes that a configuration names."""
    if isinstance(node, dict):
        if isinstance(target := node.get("_target_"), str):
            parts = target.split(".")
            names = (".".join(parts[:k]) for k in range(len(parts), 0, -1))
            yield next((name for name in names if source(name)), "")
        for value in node.values():
            yield from targets(value)
    elif isinstance(node, list):
        for value in node:
            yield from targets(value)


def of_files(files: Iterable[Path]) -> dict[str, Digests]:
    """Digest configuration files and the code that they name."""
    chosen = sorted(set(files))
    content = {
        str(file): _digest(json.dumps(configuration(file), sort_keys=True).encode()) for file in chosen
    }
    code = of_code({module for file in chosen for module in targets(configuration(file)) if module})
    return {"configuration": content, "code": code}


def of_list(values: Any, keys: Mapping[str, Any]) -> dict[str, Any]:
    """Digest a list of params.yaml with the configuration files that it names, such as models or splits."""
    names = [*values, *values.values()] if isinstance(values, dict) else values
    chosen = [(file.parent.name, file.stem) for name in names for file in config_files(f"*/{name}.yaml")]
    own = {f"{group}/{name}": keys[group][name] for group, name in chosen if name in keys.get(group, {})}
    found = of_files(file for choice in chosen for file in built_on(*choice))
    return {"list": values, **found, **_keys(own)}


def _keys(own: Any) -> dict[str, Any]:
    return {"keys": own} if own else {}


def all_digests(params: Mapping[str, Any], keys: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of all digest files, by their names below `OUT`."""
    found = {file.stem: of_files([file]) | _keys(keys.get(file.stem)) for file in config_files("*.yaml")}
    for group, name in {(file.parent.name, file.stem) for file in config_files("*/*.yaml")}:
        found[f"{group}/{name}"] = of_files(built_on(group, name)) | _keys(keys.get(group, {}).get(name))
    lists = {key: value for key, value in params.items() if key != "keys" and isinstance(value, list | dict)}
    return found | {f"lists/{key}": of_list(values, keys) for key, values in lists.items()}


def main() -> int:
    """Write all digests of the checkout in the working directory; return the exit code."""
    keys = read_keys()
    try:
        check_keys(keys, PROGRAM)
    except BadInput as error:
        return refuse(error)
    shutil.rmtree(OUT, ignore_errors=True)
    for name, content in all_digests(configuration(FILE), keys).items():
        file = OUT / f"{name}.json"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
