"""Objects that other packages add by entry points."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.metadata import entry_points
from typing import Any

from unmodelled.base.errors import BadInput


def additions(group: str, kind: str, attribute: str) -> Iterator[tuple[str, Any]]:
    """Yield the objects of a group of entry points after their names in messages: "law drag (mine:DRAG)"."""
    for point in entry_points(group=group):
        name = f"{kind} {point.name} ({point.value})"
        try:
            found = point.load()
            getattr(found, attribute)
        except Exception as error:  # there is no common base of what an import can raise
            cure = "repair its package, or remove it"
            raise BadInput(f"{name} cannot be loaded ({error}): {cure}") from None
        yield name, found
