"""Numbers and units as people read them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: Any) -> str:
    """Return four significant digits; whole numbers in full."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    size = abs(value)
    if isinstance(value, int) or 1e4 <= size < 1e7:
        text = f"{value:,.0f}".replace(",", "\u202f" if size >= 1e4 else "")
    elif size and not 1e-4 <= size < 1e7:
        mantissa, exponent = f"{value:.2e}".split("e")
        text = f"{mantissa}×10{str(int(exponent)).translate(SUPERSCRIPTS)}"
    else:
        text = f"{value:.4g}"
    return text.replace("-", "−")


def quantity(value: Any, interval: Sequence[float] | None) -> tuple[str, str]:
    """Return value and interval, to the two digits that the width of the interval supports."""
    if interval is None:
        return number(value), ""
    low, high = interval
    large = max(abs(low), abs(high), abs(value)) if isinstance(value, int | float) else math.inf
    if not (low < high and 1e-3 <= large < 1e6):
        return number(value), f"{number(low)} to {number(high)}"
    digits = max(0, 1 - math.floor(math.log10(high - low)))
    # the z drops the sign of a zero
    shown = [f"{v:z.{digits}f}".replace("-", "−") for v in (value, low, high)]
    return shown[0], f"{shown[1]} to {shown[2]}"


def unit_text(unit: str | None) -> str:
    """Return a unit with raised exponents; empty where there is none."""
    if unit in (None, "", "-", "1"):
        return ""
    return re.sub(r"\^(-?\d+)", lambda match: match[1].translate(SUPERSCRIPTS), str(unit))


def percentage(unit: str) -> tuple[bool, str]:
    """Return whether a number of this unit is a share, and the rest of the unit: "lower, share" is
    "lower".
    """
    found = re.fullmatch(r"(?:(?P<before>[^,]+), )?share(?P<after> \(.*\))?", unit)
    return bool(found), f"{found['before'] or ''}{found['after'] or ''}".strip() if found else unit


def duration(seconds: float) -> str:
    """Return a duration in seconds, minutes or hours, the larger two of them."""
    if round(seconds, 1) < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest} s"
    return f"{minutes // 60} h {minutes % 60} min"
