"""Compiled kernels, kept on disk between runs."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import sympy as sp

from pipeline.files import replacing
from pipeline.physics.kernel.layout import Layout
from pipeline.physics.kernel.source import layout, source
from pipeline.physics.kernel.structure import Augmented
from pipeline.physics.system.model import System

_HERE = Path(__file__).parent
#: What the generated code depends on besides the model.
_GENERATOR = (
    *("layout.py", "scalars.py", "source.py", "printer.py"),
    *("../system/functions.py", "../system/tables.py"),
)


@dataclass(frozen=True)
class Kernel:
    """The compiled model: arguments of the functions in `loops` and `training`.

    Attributes:
        evaluate, pull: compiled functions of a block and the parameters. layout: of the block.
    """

    evaluate: Any
    pull: Any
    layout: Layout


def cache_folder() -> Path:
    """Where kernels are kept: HYBRID_DYNAMICS_CACHE, or the user's cache folder, or a temporary one.

    Kernels are imported, so that a folder of another user is not taken.
    """
    chosen = os.environ.get("HYBRID_DYNAMICS_CACHE")
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hybrid-dynamics"
    for folder in (
        Path(chosen) if chosen else home,
        Path(tempfile.gettempdir()) / f"hybrid-dynamics-{os.getuid()}",
    ):
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if os.access(folder, os.W_OK) and folder.stat().st_uid == os.getuid():
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp())


def generated(name: str, write: Callable[[], str]) -> ModuleType:
    """The module `name` of the cache folder; `write` gives its text where it is not there yet."""
    path = cache_folder() / f"{name}.py"
    if not path.exists():
        with replacing(path) as temporary:
            temporary.write_text(write())
    return _loaded(path)


def digest(files: Iterable[str], system: System, parts: Iterable[str]) -> str:
    """A name for what `files` of the generator make of the structure of `system` and of `parts`."""
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
    """The compiled functions of `model`, generated and compiled once for every structure.

    Parameter values and weights are arguments of the loops, so that one kernel serves a whole stack.
    """
    module = generated(f"kernel_{_digest(model)}", lambda: source(model))
    return Kernel(module.evaluate, module.pull, layout(model))


@lru_cache(maxsize=256)
def _loaded(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path}: cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # numba's cache finds a function's module by its name
    spec.loader.exec_module(module)
    return module
