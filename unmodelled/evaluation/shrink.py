"""How far a gap shrinks (shared/contracts/diagnosis.md)."""

from __future__ import annotations


def shrink(reidentified: float, model: float, floor: float) -> float:
    """Share of the squared gap above the floor that a model explains, from 0 to 1; 0 where there is none.

    Args:
        reidentified: the gap of the re-identified physics. model: that of the model. floor: of the noise.
    """
    whole = reidentified**2 - floor**2
    return min(1.0, max(0.0, (reidentified**2 - model**2) / whole)) if whole > 0.0 else 0.0
