"""Limits of the next experiment of a withheld case: what its logs stayed within."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from unmodelled.logs.logs import Logs, as_logged
from unmodelled.systems.model import System

#: Kinds of experiments that are compared.
KINDS = "proposed", "chirp", "random"
#: Share of its width by which the travel may leave the logged range.
BEYOND = 0.1


def write_limits(system: System, logs: Logs, path: Path) -> None:
    """Write the limits of an experiment as long as the logged ones (see `unmodelled.design.limits`).

    Inputs stay within their logged ranges and rates, and outputs within their logged ranges and a tenth more.
    The machine starts in the middle of its logged starts, at the conditions of the first run.
    """
    inside = np.setdiff1d(np.arange(len(logs.t) - 1), logs.offsets[1:-1] - 1)
    u = [as_logged(item, logs.u[:, k]) for k, item in enumerate(system.inputs)]
    y = {item.name: as_logged(item, logs.y[:, k]) for k, item in enumerate(system.outputs)}
    first = logs.offsets[:-1]
    states = {state.name for state in system.states}
    content: dict[str, Any] = {
        "duration": float(np.median(np.diff(logs.offsets) - 1) * logs.period),
        "inputs": {
            item.name: {
                "low": float(own.min()),
                "high": float(own.max()),
                "rate": float(np.abs(np.diff(own))[inside].max() / logs.period),
            }
            for item, own in zip(system.inputs, u, strict=True)
        },
        "travel": {
            name: {
                "low": float(own.min() - BEYOND * np.ptp(own)),
                "high": float(own.max() + BEYOND * np.ptp(own)),
            }
            for name, own in y.items()
        },
        "start": {name: float(np.median(own[first])) for name, own in y.items() if name in states},
        "operating_point": {
            item.name: float(as_logged(item, logs.c[0, k])) for k, item in enumerate(system.operating_point)
        },
    }
    path.write_text(yaml.safe_dump({name: value for name, value in content.items() if value}))
