"""Checks of the files that the report is made from."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json

#: What data can be.
KINDS = ("measured", "virtual")


def read_object(path: Path) -> dict[str, Any]:
    """Read a JSON file that holds an object."""
    content = read_json(path)
    if not isinstance(content, dict):
        raise BadInput(f"{path}: must be an object")
    return content


def check_choice(path: Path, where: str, value: Any, allowed: Sequence[str]) -> None:
    """Refuse a value that is not among the allowed ones."""
    if value not in allowed:
        raise BadInput(f"{path}: {where} {value!r}, must be one of {', '.join(allowed)}")


def check_interval(path: Path, where: str, value: Any) -> None:
    """Refuse an interval that is neither two numbers nor None."""
    if value is None:
        return
    if not isinstance(value, list) or len(value) != 2 or not all(isinstance(v, int | float) for v in value):
        raise BadInput(f"{path}: {where} interval {value!r}, must be two numbers")
