"""A start with a kernel that is in the cache against one with an empty cache, each in a fresh process."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numba

from benchmarks.timing import seconds, side_by_side

PEER = f"a first start, numba {numba.__version__} compiling"
ROOT = Path(__file__).parent.parent
START = """
from benchmarks.slider_crank import HIDDEN, SYSTEM
from unmodelled.learning.structures import one_per_port
from unmodelled.engine.compiled.compiled import kernel
from unmodelled.systems.reader import read_system
system = read_system(SYSTEM)
kernel(one_per_port(HIDDEN)(system, system.uncertain).structure)
"""


def run() -> dict[str, float]:
    """A whole process: imports, slider-crank with F = eta(d, v), its kernel and the loops that train it.

    `new_structure` is a start where only the kernel is missing: the loops serve every structure.
    """
    with tempfile.TemporaryDirectory() as scratch:
        kept = Path(scratch)
        result = side_by_side(lambda: _start(kept / "kernels", kept / "loops"), _first_start, rounds=3)
        new = [seconds(partial(_start, kept / f"new {k}", kept / "loops")) for k in range(3)]
    return {**result, "new_structure": statistics.median(new), "threads": 1}


def _first_start() -> None:
    with tempfile.TemporaryDirectory() as scratch:
        _start(Path(scratch) / "kernels", Path(scratch) / "loops")


def _start(kernels: Path, numba_cache: Path) -> None:
    folders = {"HYBRID_DYNAMICS_CACHE": str(kernels), "NUMBA_CACHE_DIR": str(numba_cache)}
    subprocess.run([sys.executable, "-c", START], cwd=ROOT, env={**os.environ, **folders}, check=True)
