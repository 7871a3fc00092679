"""Programs of the register machine as data for a browser.

The browser runs the instructions of a program by `report/static/machine.js`, the twin of the interpreter:
what a system file says stays data, and no script is generated from it.
"""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from unmodelled.engine.machine.program import Program


def as_text(values: ArrayLike) -> str:
    """Return numbers (any shape) of double precision as text, without loss of a digit."""
    return base64.b64encode(np.asarray(values, "<f8").tobytes()).decode()


def as_data(program: Program) -> dict[str, Any]:
    """Return a program as values that JSON knows; `machine.loaded` of the script reads them."""
    curves = program.curves
    return {
        "at": program.at._asdict(),
        "code": program.code.ravel().tolist(),
        "numbers": as_text(program.numbers),
        "curves": {
            "knots": as_text(curves.knots),
            "pieces": as_text(curves.pieces),
            "spans": curves.spans.ravel().tolist(),
            "ends": as_text(curves.ends),
        },
        "rates": program.rates.tolist(),
        "shown": program.shown.tolist(),
    }
