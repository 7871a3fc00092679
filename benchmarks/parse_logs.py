"""Parsing and validating raw logs against numpy.loadtxt."""

from __future__ import annotations

import io

import numpy as np

from benchmarks.timing import side_by_side
from pipeline.rawlogs import parse, validate

PEER = f"numpy.loadtxt {np.__version__}"


def run() -> dict[str, float]:
    """Ten logs of 5000 samples, one thread."""
    generator = np.random.default_rng(0)
    texts = []
    for _ in range(10):
        rows = np.vstack([np.arange(5000) * 0.0005, generator.normal(size=(6, 5000))])
        texts.append("\n".join(",".join(f"{x:.5g}" for x in row) for row in rows).encode())
    return side_by_side(
        lambda: [validate(parse(text, "log"), "log") for text in texts],
        lambda: [np.loadtxt(io.BytesIO(text), delimiter=",") for text in texts],
    )
