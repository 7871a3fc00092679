"""A system as a caller gives it: the system, the path of its file, or a result that has one."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol, TypeAlias

from unmodelled.base.errors import BadInput
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system


class HasSystem(Protocol):
    """Result that has a system: an answer, a fit, a simulation."""

    @property
    def system(self) -> System:
        """System of the result; of an answer, the augmented one."""


#: What stands for a system.
SystemGiven: TypeAlias = System | Path | str | HasSystem


def system_of(given: SystemGiven) -> System:
    """Return the system that a caller gives."""
    if isinstance(given, str | Path):
        return read_system(given)
    found: Any = given if isinstance(given, System) else getattr(given, "system", None)
    if isinstance(found, System):
        return found
    wanted = "a system, the path of its file, or a result that has one, such as an answer"
    raise BadInput(f"system: must be {wanted}, got {type(given).__name__}")
