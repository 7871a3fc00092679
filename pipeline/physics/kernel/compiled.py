"""Compiled kernels, kept on disk between runs."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from types import ModuleType

import sympy as sp

from pipeline.physics.kernel import source
from pipeline.physics.kernel.structure import Augmented

_HERE = Path(__file__).parent
_MARK = "# --- generated ---"


def cache_folder() -> Path:
    """Where kernels are kept: HYBRID_DYNAMICS_CACHE, or the user's cache folder, or a temporary one."""
    chosen = os.environ.get("HYBRID_DYNAMICS_CACHE")
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hybrid-dynamics"
    for folder in (
        Path(chosen) if chosen else home,
        Path(tempfile.gettempdir()) / f"hybrid-dynamics-{os.getuid()}",
    ):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp())


def _digest(model: Augmented) -> str:
    system = model.system
    parts = [(_HERE / name).read_text() for name in ("template.py", "source.py", "printer.py")] + [
        sp.srepr(e) for e in (*system.closed, *model.inputs)
    ]
    names = [[s.name for s in group] for group in (system.x, system.u, system.p, system.c, system.e, model.p)]
    tables = [(t.x, t.y, t.kind) for t in system.tables]
    networks = [(n.port, len(n.inputs), n.hidden) for n in model.networks]
    parts.append(repr((names, tables, networks, system.port_names)))
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:24]


def kernel(model: Augmented) -> ModuleType:
    """The compiled functions of `model`: `simulate`, `pullback` and `train` of `template.py`.

    Generated and compiled once for every structure; parameter values are arguments.
    """
    name = f"kernel_{_digest(model)}"
    path = cache_folder() / f"{name}.py"
    if not path.exists():
        head, _, tail = (_HERE / "template.py").read_text().partition(_MARK)
        text = f"{head}{_MARK}\n{source.source(model)}\n{tail[tail.index(chr(10)) :]}"
        temporary = path.with_name(f".{name}.{os.getpid()}.tmp")
        temporary.write_text(text)
        temporary.replace(path)
    return _loaded(path)


@lru_cache(maxsize=256)
def _loaded(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path}: cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # numba's cache finds a function's module by its name
    spec.loader.exec_module(module)
    return module
