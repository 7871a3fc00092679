"""Names that a system file declares for its expressions."""

from __future__ import annotations

import keyword
import re
from dataclasses import dataclass, field

from unmodelled.systems.document import Node
from unmodelled.systems.operations import RESERVED
from unmodelled.systems.syntax import shown

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}", re.ASCII)


@dataclass
class Names:
    """Names of a system file that expressions can use."""

    #: kind ("state", "input", ...) and line number of each name
    kinds: dict[str, tuple[str, int]] = field(default_factory=dict)
    refused: bool = False  # whether a name was refused, so that expressions may use names that do not exist

    def add(self, name: str, kind: str, node: Node) -> str:
        """Register a new name."""
        before, self.refused = self.refused, True  # unless it passes
        checked_name(name, node)
        if name in RESERVED or keyword.iskeyword(name):
            raise node.wrong(f"the name {shown(name)} is reserved: choose another name")
        if name in self.kinds:
            other, line = self.kinds[name]
            raise node.wrong(
                f"the name {shown(name)} is taken by the {other} of line {line}: choose another name"
            )
        self.kinds[name] = (kind, node.line)
        self.refused = before
        return name


def checked_name(name: str, node: Node) -> str:
    """Return a name after a check of its characters."""
    if not _NAME.fullmatch(name):
        raise node.wrong(f"a name is a letter and up to 63 letters, digits or _, got {shown(name)}")
    return name
