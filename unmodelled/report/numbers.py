"""Format numbers and units for readers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from unmodelled.base.wording import amounts, number, unit_text

__all__ = ["amounts", "number", "quantity", "short", "unit_text"]


def quantity(value: Any, interval: Sequence[float] | None) -> tuple[str, str]:
    """Format a value and its interval with two significant digits of the width of the interval.

    A number that these digits would round to zero has two digits of its own, where zero is outside of the
    interval.
    """
    if interval is None:
        return number(value), ""
    low, high = interval
    large = max(abs(low), abs(high), abs(value)) if isinstance(value, int | float) else math.inf
    if not (low < high and 1e-3 <= large < 1e6):
        return number(value), f"{number(low)} to {number(high)}"
    digits = max(0, 1 - math.floor(math.log10(high - low)))
    crosses = low < 0.0 < high

    def shown(v: float) -> str:
        if v and not crosses and round(v, digits) == 0.0:
            return number(float(f"{v:.2g}"))
        return f"{v:z.{digits}f}".replace("-", "−")  # the z drops the sign of a zero

    return shown(value), f"{shown(low)} to {shown(high)}"


def short(value: float | None) -> str:
    """Return a number with three significant digits."""
    return number(value if value is None else float(f"{value:.3g}"))
