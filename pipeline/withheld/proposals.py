"""Limits of the next experiment of a withheld case: what its logs stayed within."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Kinds of experiments that are compared.
KINDS = "proposed", "chirp", "random"
#: Share of its width by which the travel may leave the logged range.
BEYOND = 0.1


def write_limits(system: System, logs: Logs, path: Path) -> None:
    """Write the limits of an experiment as long as the logged ones (see `unmodelled.design.limits`).

    Inputs stay within their logged ranges and rates, and outputs within their logged ranges and a tenth more.
    The machine starts in the middle of its logged starts, at the conditions of the first run.

    Args:
        system: system of the case.
        logs: logs of the case.
        path: YAML file to write.
    """
    inside = np.setdiff1d(np.arange(len(logs.t) - 1), logs.offsets[1:-1] - 1)
    rates = np.abs(np.diff(logs.u, axis=0))[inside].max(0) / logs.period
    first = logs.offsets[:-1]
    seen = {n: (float(y.min()), float(y.max())) for n, y in zip(logs.outputs, logs.y.T, strict=True)}
    states = {state.name for state in system.states}
    content: dict[str, Any] = {
        "duration": float(np.median(np.diff(logs.offsets) - 1) * logs.period),
        "inputs": {
            item.name: {"low": float(u.min()), "high": float(u.max()), "rate": float(rate)}
            for item, u, rate in zip(system.inputs, logs.u.T, rates, strict=True)
        },
        "travel": {
            name: {"low": low - BEYOND * (high - low), "high": high + BEYOND * (high - low)}
            for name, (low, high) in seen.items()
        },
        "start": {
            n: float(np.median(y[first])) for n, y in zip(logs.outputs, logs.y.T, strict=True) if n in states
        },
        "operating_point": dict(zip(logs.constants, logs.c[0].tolist(), strict=True)),
    }
    path.write_text(yaml.safe_dump({name: value for name, value in content.items() if value}))
