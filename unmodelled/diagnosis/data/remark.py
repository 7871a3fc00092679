"""Remarks on the numbers of a fit, and numbers with units in sentences."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

#: Reason of a remark: a number at a bound, an effort or a gain that is too large, a change of sign, a mass
#: that changed too much, an effect that may as well be absent, a common factor of parameters, or numbers that
#: the logs do not determine.
Kind = Literal["bound", "effort", "gain", "sign", "mass", "zero", "common_factor", "undetermined"]


@dataclass(frozen=True)
class Remark:
    """A remark on fitted numbers."""

    numbers: tuple[str, ...]
    kind: Kind
    sentence: str  # observation with values and units, and what to do about it


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """Return a number with its unit.

    Examples:
        >>> quantity(0.01234, "N m"), quantity(2.0, "1")
        ('0.0123 N m', '2')
    """
    text = f"{value:.{digits}g}"
    return text if unit in ("", "1", "-") else f"{text} {unit}"


def listed(words: Iterable[str]) -> str:
    """Return one or more words as a list in a sentence.

    Examples:
        >>> listed(("J", "b", "mgl"))
        'J, b and mgl'
    """
    *first, last = words
    return " and ".join(filter(None, [", ".join(first), last]))
