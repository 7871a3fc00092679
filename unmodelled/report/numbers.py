"""Format numbers and units for readers."""

from __future__ import annotations

from unmodelled.base.wording import amounts, number, quantity, unit_text

__all__ = ["amounts", "number", "quantity", "short", "unit_text"]


def short(value: float | None) -> str:
    """Return a number with three significant digits."""
    return number(value if value is None else float(f"{value:.3g}"))
