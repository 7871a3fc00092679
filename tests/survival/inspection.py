"""What a kill may leave: whole files under their names, nothing else."""

import json
import math
import zipfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pandas as pd
import pyarrow.parquet as pq

from unmodelled.learning.checkpoint import read_checkpoint

#: Folders of results.
RESULTS = ("data", "reports")
#: Relative; sums of floating-point numbers hang on how many threads the machine had to spare.
TOLERANCE = 1e-6
#: What no two runs share: times, memory, and the state of the code.
OWN = ("seconds", "memory", "revision")


def _page(path: Path) -> None:
    if not path.read_text().rstrip().endswith("</html>"):
        raise ValueError("no end")


def _archive(path: Path) -> None:
    with zipfile.ZipFile(path) as archive:
        if bad := archive.testzip():
            raise ValueError(f"{bad} is damaged")


READERS: dict[str, Callable[[Path], object]] = {
    ".json": lambda path: json.loads(path.read_text()),
    ".parquet": lambda path: pq.ParquetFile(path).read(),
    ".csv": pd.read_csv,
    ".svg": ElementTree.parse,
    ".html": _page,
    ".pt": read_checkpoint,
    ".zip": _archive,
}


def half_written(root: Path) -> list[str]:
    """Results that are not whole, a line each; what has a hidden name, or lies under one, is no result."""
    return [f"{path}: {reason}" for path in results(root) if (reason := _flaw(path))]


def results(root: Path) -> Iterator[Path]:
    """All files under the names of results."""
    for path in (path for name in RESULTS for path in sorted((root / name).rglob("*"))):
        hidden = any(part.startswith(".") for part in path.relative_to(root).parts)
        if path.is_file() and not hidden:
            yield path


def _flaw(path: Path) -> str:
    if path.name.endswith(".tmp"):
        return "is a temporary file"
    if path.stat().st_size == 0:
        return "is empty"
    try:
        READERS.get(path.suffix, Path.read_bytes)(path)
    except Exception as error:  # whatever a reader raises, the file is not whole
        return f"{type(error).__name__}: {error}"
    return ""


def metrics(root: Path) -> dict[str, Any]:
    """All leaves of reports/metrics/*.json, by file and dotted name, save those in `OWN`."""
    found: dict[str, Any] = {}
    for path in sorted((root / "reports" / "metrics").glob("*.json")):
        found |= dict(_leaves(json.loads(path.read_text()), path.stem))
    return found


def _leaves(node: Any, name: str) -> Iterator[tuple[str, Any]]:
    if isinstance(node, dict):
        for key, inner in node.items():
            if not any(word in key for word in OWN):
                yield from _leaves(inner, f"{name}.{key}")
    elif isinstance(node, list):
        for k, inner in enumerate(node):
            yield from _leaves(inner, f"{name}[{k}]")
    else:
        yield name, node


def differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """Metrics that differ by more than `TOLERANCE`, a line each."""
    absent = object()
    names = dict.fromkeys([*one, *other])
    pairs = {name: (one.get(name, absent), other.get(name, absent)) for name in names}
    return [f"{name}: {a} and {b}" for name, (a, b) in pairs.items() if not _equal(a, b)]


def _equal(a: object, b: object) -> bool:
    if isinstance(a, int | float) and isinstance(b, int | float):
        return math.isclose(a, b, rel_tol=TOLERANCE, abs_tol=1e-12)
    return a == b
