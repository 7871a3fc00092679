"""The unit of a column of time, by the file, its name or its numbers, and its values in seconds."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Array
from unmodelled.systems.units import SECOND, LoggedUnit, parse_logged

DAY = 86_400.0  # s
#: Days from the beginning of a count to 1970: Julian days, MATLAB's datenum, spreadsheets, days since 1970.
BEGINNINGS = (2_440_587.5, 719_529.0, 25_569.0, 0.0)
#: The years 2000 and 2100 in days since 1970, between which machines are logged.
LOGGED = (10_957.0, 47_482.0)
#: Longest median step that tells a count of days from seconds, for none is logged at more than 50 kHz.
STEP = 2e-5
#: Words at the end of the name of a column of time that are its unit.
WORDS = {
    "d": "datenum day days tag tage",
    "h": "h hour hours std stunde stunden",
    "min": "min mins minute minutes minuten",
    "s": "s sec secs second seconds sek sekunde sekunden",
    "ms": "ms msec msecs millis millisecond milliseconds",
    "us": "us µs usec usecs micros microsecond microseconds",
    "ns": "ns nsec nsecs nanos nanosecond nanoseconds",
}
#: Units in which a place in a log is told; a count of days is a date, and its places are told in s.
CLOCKS = ("h", "min", "s", "ms", "us", "ns")


def seconds_of(unit: str) -> float | None:
    """Return how many seconds a unit of time has; None for other units and other texts."""
    try:
        si, logged = parse_logged(unit)
    except ValueError:
        return None
    if si.dimension != SECOND:
        return None
    return float(f"{(logged or LoggedUnit(unit, 1.0, 0.0)).factor:.12g}")


def clock_unit(seconds: float | None) -> str:
    """Return the unit in which places in a log are told, by the length of the unit of its clock, s."""
    return next((unit for unit in CLOCKS if seconds_of(unit) == seconds), "s")


def clock_column(unit: str) -> str:
    """Return the name of the clock in a table that is written: the unit stands in it, unless it is s.

    Examples:
        >>> clock_column("s"), clock_column("ms")
        ('t', 't_ms')
    """
    return "t" if unit == "s" else f"t_{unit}"


def on_clock(seconds: float, unit: str) -> str:
    """Return a place in a log, s since the start of its experiment, in the unit of the clock.

    Examples:
        >>> on_clock(0.25, "s"), on_clock(12.3456, "ms")
        ('0.25 s', '12346 ms')
    """
    value = seconds / (seconds_of(unit) or 1.0)
    return f"{value:.4g} {unit}" if abs(value) < 1000.0 else f"{value:.0f} {unit}"


def in_clock(table: pd.DataFrame, unit: str) -> pd.DataFrame:
    """Return a table with column `t` (s) as it is written: in the unit of a clock, named by the unit.

    Examples:
        >>> in_clock(pd.DataFrame({"t": [0.0, 0.25]}), "ms").to_dict("list")
        {'t_ms': [0.0, 250.0]}
    """
    return table.assign(t=table["t"] / (seconds_of(unit) or 1.0)).rename(columns={"t": clock_column(unit)})


def unit_of_time(name: str, values: Array) -> str | None:
    """Return the unit of a column (rows,) of time by its name or its numbers; None if neither tells."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name[-60:])
    words = re.findall(r"[A-Za-zµ]+", re.sub(r"\[\d+\]$", "", apart))
    last = words[-1].lower() if words else ""
    found = next((unit for unit, known in WORDS.items() if last in known.split()), None)
    return found or ("d" if looks_like_days(values) else None)


def looks_like_days(values: Array) -> bool:
    """Return whether numbers (rows,) are a count of days, as MATLAB and spreadsheets write dates."""
    known = values[np.isfinite(values)]
    steps = np.diff(known)
    steps = steps[steps > 0.0]
    return bool(len(steps) and np.median(steps) < STEP) and _beginning(known) is not None


def in_seconds(values: Array, seconds: float) -> Array:
    """Return a column of time (rows,) in s; a count of days starts in 1970, which leaves more digits."""
    beginning = _beginning(values[np.isfinite(values)]) if seconds == DAY else None
    return seconds * (values - (beginning or 0.0))


def _beginning(days: Array) -> float | None:
    """The beginning of a count of days, before 1970; None if it is none of those that are used."""
    middle = float(np.median(days)) if len(days) else np.nan
    return next((first for first in BEGINNINGS if LOGGED[0] < middle - first < LOGGED[1]), None)
