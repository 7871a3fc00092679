"""Compiled kernels, kept on disk between runs."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib.abc import InspectLoader
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

import sympy as sp

from unmodelled.base.compiling import check_private, remove_doubtful, tell
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing
from unmodelled.engine.compiled.layout import Layout
from unmodelled.engine.compiled.source import layout, source
from unmodelled.engine.compiled.structure import Augmented
from unmodelled.systems.model import System

_HERE = Path(__file__).parents[1]
#: What the generated code depends on besides the model, seen from the folder of the engine.
_GENERATOR = (
    *(f"compiled/{name}.py" for name in ("layout", "scalars", "source", "printer")),
    *("../systems/functions.py", "../systems/procedure.py", "../systems/sticking.py"),
    "../systems/tables.py",
)


@dataclass(frozen=True)
class Kernel:
    """Compiled model: arguments of the functions in `loops` and `training`."""

    evaluate: Any  # derivatives and efforts of a block of samples
    pull: Any  # propagates gradients through the block
    layout: Layout


def cache_folders() -> Iterator[Path]:
    """Yield folders where kernels can be kept, the best first: HYBRID_DYNAMICS_CACHE, or the user's cache.

    The last one is temporary. Kernels are imported: no folder and no file to which others may write is used.
    """
    chosen = os.environ.get("HYBRID_DYNAMICS_CACHE")
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "unmodelled"
    for folder in (
        Path(chosen) if chosen else home,
        Path(tempfile.gettempdir()) / f"unmodelled-{os.getuid()}",
    ):
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            check_private(folder)
            remove_doubtful(folder, (".py",))
            if (folder / "__pycache__").is_dir():
                remove_doubtful(folder / "__pycache__", (".pyc",))
            if os.access(folder, os.W_OK):
                yield folder
        except OSError:
            continue
        except BadInput as refused:
            tell(str(refused))


def generated(name: str, write: Callable[[], str]) -> ModuleType:
    """Return a generated module from the cache folder; where nothing can be written, it is not kept."""
    for folder in cache_folders():
        path = folder / f"{name}.py"
        try:
            if not path.exists():
                with replacing(path) as temporary:
                    temporary.write_text(write())
                    temporary.chmod(0o600)
        except BadInput as refused:
            tell(f"{refused}: compiled functions are kept elsewhere, or not at all")
            continue
        return _loaded(path)
    return _unkept(name, write)


def digest(files: Iterable[str], system: System, parts: Iterable[str]) -> str:
    """Return a name for generated code, which changes with all that decides the code."""
    names = [[s.name for s in group] for group in (system.x, system.u, system.p, system.c, system.e)]
    tables = [(t.x, t.y, t.kind) for t in system.tables]
    known = [*(sp.srepr(e) for e in system.closed), repr((names, tables, system.port_names))]
    texts = [(_HERE / name).read_text() for name in files]
    return hashlib.sha256("\0".join([*texts, *known, *parts]).encode()).hexdigest()[:24]


def _digest(model: Augmented) -> str:
    networks = [(n.port, len(n.inputs), n.hidden) for n in model.networks]
    parts = [*(sp.srepr(e) for e in model.inputs), repr((model.trainable, networks))]
    return digest(_GENERATOR, model.system, parts)


@lru_cache(maxsize=256)
def kernel(model: Augmented) -> Kernel:
    """Return the compiled functions of a model, generated and compiled once for every structure.

    Parameter values and weights are arguments of the loops, so that one kernel serves a whole stack.
    """
    module = generated(f"kernel_{_digest(model)}", lambda: source(model))
    return Kernel(module.evaluate, module.pull, layout(model))


@lru_cache(maxsize=256)
def _loaded(path: Path) -> ModuleType:
    return _imported(importlib.util.spec_from_file_location(path.stem, path), path.stem)


class _Text(InspectLoader):
    """Loads a module from its text."""

    def __init__(self, text: str) -> None:
        self._text = text

    def get_source(self, _: str) -> str:
        return self._text


def _unkept(name: str, write: Callable[[], str]) -> ModuleType:
    if name not in sys.modules:
        _imported(importlib.util.spec_from_loader(name, _Text(write())), name)
    return sys.modules[name]


def _imported(spec: ModuleSpec | None, name: str) -> ModuleType:
    if spec is None or spec.loader is None:
        raise ImportError(f"{name}: cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # numba's cache finds a function's module by its name
    spec.loader.exec_module(module)
    return module
