"""Which numbers of an answer are sure enough for its title, and how doubtful ones are told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from unmodelled.base.wording import amounts

Entry = Mapping[str, Any]

#: Remarks on a number in words, by their kinds.
REMARKS = {
    "bound": "at a limit of its values",
    "effort": "implausibly large",
    "gain": "implausible",
    "sign": "changed its sign",
    "mass": "implausible",
    "zero": "may as well be zero",
    "common_factor": "wrong by a common factor",
    "undetermined": "not determined by these logs",
    "guess": "in proportion to a guess of the system file",
}
#: Width of an interval at a limit, in the number, that does not tell how sure the number is.
LIMIT = 1e-3
#: Kinds of numbers whose interval does not tell their size.
IMPLAUSIBLE = {"effort", "gain", "mass"}


def as_said(entry: Entry) -> Entry:
    """Return a number of diagnosis.json, or its errors of an output, in the units of the logs."""
    return {**entry, **entry.get("shown", {})}


def kinds(entry: Entry) -> list[str]:
    """Return the kinds of the remarks on a number of diagnosis.json, also of one that lists none."""
    flags = {"undetermined": not entry.get("determined", True), "bound": bool(entry.get("at_bound"))}
    return list(dict.fromkeys([*entry.get("remarks", ()), *(kind for kind, is_so in flags.items() if is_so)]))


def remark(entry: Entry) -> str:
    """Return the remarks on a number in words; empty where it is sure.

    Examples:
        >>> remark({"value": 276.0, "remarks": ["effort"]}), remark({"value": 6.2, "determined": True})
        ('implausibly large', '')
    """
    return ", ".join(dict.fromkeys(REMARKS.get(kind, kind.replace("_", " ")) for kind in kinds(entry)))


def interval_of(entry: Entry) -> tuple[float, float] | None:
    """Return the interval of a number that tells its size; None without one, or of a number at a limit.

    The interval of a number that ended at a limit of its values shrinks to the limit.

    Examples:
        >>> interval_of({"interval": [0.9999998, 1.0], "at_bound": True})
        >>> interval_of({"interval": [0.0, 0.2], "at_bound": True})
        (0.0, 0.2)
    """
    low, high = _ends(entry)
    if low is None or high is None:
        return None
    at_limit = "bound" in kinds(entry) and abs(high - low) <= LIMIT * max(abs(low), abs(high))
    return None if at_limit else (float(low), float(high))


def main_number(effect: Entry) -> Entry | None:
    """Return the first number of an effect with a unit that differs from zero; None if it is doubtful."""
    for entry in map(as_said, effect["parameters"].values()):
        if _has_unit(entry) and kinds(entry):
            return None
        if _has_unit(entry) and not _may_be_zero(entry):
            return entry
    return None


def doubt(effect: Entry) -> str:
    r"""Return what is doubtful about the size of an effect; empty where a title can tell the size.

    Examples:
        >>> number = {"value": 0.2, "unit": "N m", "interval": [0.0, 0.4]}
        >>> doubt({"parameters": {"F_c": number}})
        'size uncertain: 0 to 0.4\xa0N\xa0m'
        >>> doubt({"parameters": {"F_c": {**number, "interval": [0.1, 0.3], "remarks": ["effort"]}}})
        'size implausible'
        >>> doubt({"parameters": {"F_c": {**number, "interval": [0.1, 0.3]}}})
        ''
    """
    numbers = [as_said(entry) for entry in effect["parameters"].values() if "values" not in entry]
    every, open_ = {kind for entry in numbers for kind in kinds(entry)}, list(filter(_may_be_zero, numbers))
    if main_number(effect) or not (every or len(open_) == len(numbers) > 0):
        return ""
    if every & IMPLAUSIBLE:
        return "size implausible"
    for entry in open_:
        low, high = _ends(entry)
        if low is not None and high is not None and low < high:
            first, last = amounts([low, high], entry["unit"])
            return f"size uncertain: {first.partition(chr(0xA0))[0]} to {last}"
    return "size uncertain"


def _has_unit(entry: Entry) -> bool:
    return str(entry["unit"]) not in ("", "1", "-")


def _may_be_zero(entry: Entry) -> bool:
    low, high = _ends(entry)
    return entry["value"] is None or low is None or high is None or not low * high > 0.0


def _ends(entry: Entry) -> tuple[float | None, float | None]:
    low, high = entry["interval"] or (None, None)
    return low, high
