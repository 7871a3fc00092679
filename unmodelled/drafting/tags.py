"""Tags of process plants, such as LT101 or LIC-101.PV, with the letters of ISA 5.1."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

#: First letter, modifier, function, and loop number; the signal of a controller stands behind it.
_TAG = re.compile(
    r"(?<![A-Za-z])(?P<first>[FLPTSWEIJZH])[DFQ]?(?P<function>E|R|Q|I?R?[TC]|I|C?V|Z|Y|[SA][HL]{0,2})"
    r"[-_ ]?(?P<loop>\d{1,5})[A-Z]?(?:[._ /-]?(?P<signal>PV|SP|SV|OP|MV|CO|OUT)(?![A-Za-z]))?(?![A-Za-z])"
)


@dataclass(frozen=True)
class Tag:
    """Meaning of a process tag."""

    variable: str  # first letter: L level, F flow, T temperature, P pressure, ...
    kind: Literal["value", "set point", "opening", "switch"]
    sure: bool = True  # of a loop with one digit, only the unit tells a tag from another short name


def tag_in(name: str) -> Tag | None:
    """Return the meaning of the process tag in the name of a column; None if there is none.

    Examples:
        >>> [tag_in(name).kind for name in ("LT101 [cm]", "FV103", "LIC101.SP", "TIC_30_OP", "LSH12")]
        ['value', 'opening', 'set point', 'opening', 'switch']
        >>> tag_in("FT-102A").variable, tag_in("AI1"), tag_in("LT1").sure
        ('F', None, False)
    """
    found = _TAG.search(name)
    if found is None:
        return None
    variable, function, signal = found["first"], found["function"], found["signal"]
    sure = len(found["loop"]) > 1 or signal is not None
    if signal in ("SP", "SV"):
        return Tag(variable, "set point")
    if signal in ("OP", "MV", "CO", "OUT") or function in ("V", "CV", "Z", "Y"):
        return Tag(variable, "opening", sure)
    return Tag(variable, "switch" if function[0] in "SA" else "value", sure)
