"""Checks of the files that a report is made from."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json


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


def check_chapter(path: Path, where: str, value: Any, *, needed: bool = False) -> None:
    """Refuse a chapter that is not a whole number."""
    if (value is None and needed) or not isinstance(value, int | None):
        raise BadInput(f"{path}: {where} chapter {value!r}, must be a whole number")
