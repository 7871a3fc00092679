"""Format shares and durations for readers."""

from __future__ import annotations

import re


def percentage(unit: str) -> tuple[bool, str]:
    """Tell whether a number is shown in percent, by its unit."""
    found = re.fullmatch(r"(?:(?P<before>[^,]+), )?share(?P<after> \(.*\))?", unit)
    return bool(found), f"{found['before'] or ''}{found['after'] or ''}".strip() if found else unit


def duration(seconds: float) -> str:
    """Format a duration (s) in seconds, in minutes and seconds, or in hours and minutes."""
    if round(seconds, 1) < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest} s"
    return f"{minutes // 60} h {minutes % 60} min"
