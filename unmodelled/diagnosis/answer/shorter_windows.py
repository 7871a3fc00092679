"""Advice on the horizon where an answer leaves most of the gap."""

from __future__ import annotations

from collections.abc import Iterator

from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.diagnosis.doubts.confidence import MOST

#: The advised horizon: a sixth of that of the answer, if that has so many samples at least.
SHORTER, FEWEST = 6.0, 8


def shorter_windows(found: Diagnosis) -> Iterator[str]:
    """Yield a note that shorter windows may show what the answer lacks.

    A ripple of 42 waves per turn is half a wave off where the simulated angle is 0.07 rad off. Over windows
    in which the known physics errs by more, the errors do not show the ripple.
    """
    along = any(port.position is not None and port.domain == "power" for port in found.system.ports)
    seconds = found.horizon / SHORTER
    if found.verdict not in ("main_effect", "unknown") or found.shrink >= MOST or not along:
        return
    if seconds >= FEWEST * found.logs.period:
        yield (
            "most of the gap is left: what changes within a small part of the travel, such as ripple or "
            f"play, shows in short windows only; diagnose again with horizon={seconds:.2g}"
        )
