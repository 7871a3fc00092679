"""Checks of the files that a report is made from."""

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


def read_rows(path: Path, keys: Sequence[str]) -> list[dict[str, Any]]:
    """Read a JSON file that holds a list of objects with given keys."""
    content = read_json(path)
    if not isinstance(content, list) or not all(isinstance(row, dict) for row in content):
        raise BadInput(f"{path}: must be a list of objects")
    for i, row in enumerate(content, 1):
        missing = [key for key in keys if key not in row]
        if missing:
            raise BadInput(f"{path}: row {i} has no {', '.join(missing)}")
    return content


def check_choice(path: Path, where: str, value: Any, allowed: Sequence[str]) -> None:
    """Refuse a value that is not among the allowed ones."""
    if value not in allowed:
        raise BadInput(f"{path}: {where} {value!r}, must be one of {', '.join(allowed)}")


def check_chapter(path: Path, where: str, value: Any, *, needed: bool = False) -> None:
    """Refuse a chapter that is not a whole number."""
    if (value is None and needed) or not isinstance(value, int | None):
        raise BadInput(f"{path}: {where} chapter {value!r}, must be a whole number")


def check_interval(path: Path, where: str, value: Any) -> None:
    """Refuse an interval that is neither two numbers nor None."""
    if value is None:
        return
    if not isinstance(value, list) or len(value) != 2 or not all(isinstance(v, int | float) for v in value):
        raise BadInput(f"{path}: {where} interval {value!r}, must be two numbers")
