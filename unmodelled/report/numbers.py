"""Format numbers and units for readers."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

from unmodelled.base.wording import SUPERSCRIPTS


def number(value: Any) -> str:
    """Format a number with four significant digits, or a whole number in full.

    Args:
        value: number or text; None and numbers that are not finite are shown as a dash.
    """
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
    """Format a value and its interval with two significant digits of the width of the interval.

    Args:
        value: value to format.
        interval: lower and upper limit; None if there is no interval.

    Returns:
        Text of the value and text of the interval, the latter empty if there is no interval.
    """
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


#: Units that are shown with a prefix where a quantity is small, and the prefixes with their sizes.
_PREFIXED = ("m", "s", "rad", "N", "N m", "A", "V", "W", "J")
_PREFIXES = ((0.1, 1.0, ""), (1e-4, 1e-3, "m"), (0.0, 1e-6, "µ"))


def amounts(values: Sequence[float], unit: str, digits: int = 2) -> list[str]:
    r"""Format quantities of one unit for a sentence, with the prefix that suits the largest of them.

    Number and unit stay on one line.

    Args:
        values: quantities, in `unit`.
        unit: unit as in a system file.
        digits: significant digits, default 2.

    Examples:
        >>> amounts([0.014, 0.0002], "m")
        ['14\xa0mm', '0.2\xa0mm']
        >>> amounts([1.804], "N", digits=3), amounts([130.0], "m^3/s")
        (['1.8\xa0N'], ['130\xa0m³/s'])
    """
    largest = max(map(abs, values), default=0.0)
    size, prefix = 1.0, ""
    if unit in _PREFIXED and 1e-7 <= largest < 0.1:
        size, prefix = next((size, prefix) for least, size, prefix in _PREFIXES if largest >= least)
    shown = [f"{number(float(f'{v / size:.{digits}g}'))} {prefix}{unit_text(unit)}" for v in values]
    return [text.strip().replace(" ", "\u00a0") for text in shown]


def unit_text(unit: str | None) -> str:
    """Format a unit with raised exponents.

    Args:
        unit: unit as in a system file, such as `kg*m^2`; None if there is none.

    Returns:
        Formatted unit; empty for a number without unit.
    """
    if unit in (None, "", "-", "1"):
        return ""
    return re.sub(r"\^(-?\d+)", lambda match: match[1].translate(SUPERSCRIPTS), str(unit))


def percentage(unit: str) -> tuple[bool, str]:
    """Tell whether a number is shown in percent, by its unit.

    Args:
        unit: unit such as "share" or "lower, share".

    Returns:
        Whether the unit is a share, and the rest of the unit ("lower, share" gives "lower").
    """
    found = re.fullmatch(r"(?:(?P<before>[^,]+), )?share(?P<after> \(.*\))?", unit)
    return bool(found), f"{found['before'] or ''}{found['after'] or ''}".strip() if found else unit


def duration(seconds: float) -> str:
    """Format a duration in seconds, in minutes and seconds, or in hours and minutes.

    Args:
        seconds: duration, s.
    """
    if round(seconds, 1) < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest} s"
    return f"{minutes // 60} h {minutes % 60} min"
