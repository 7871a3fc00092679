"""Words of the drafted files: numbers of joints, names, comments on one line."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from unmodelled.drafting.joints import Joint

#: Characters of a text from the logs in a comment.
LONGEST = 120


def numbered(joints: Sequence[Joint]) -> Iterator[tuple[str, Joint]]:
    """Yield the joints with the numbers of their symbols; a single one has none.

    Args:
        joints: joints in order.
    """
    for k, joint in enumerate(joints, start=1):
        yield (str(k) if len(joints) > 1 else ""), joint


def word(text: str) -> str:
    """Return a name for a system file.

    Args:
        text: any text.

    Examples:
        >>> word("day 1 (north)"), word("2026-11-25")
        ('day_1_north', 'machine_2026_11_25')
    """
    found = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "machine"
    return found if found[0].isalpha() else f"machine_{found}"


def one_line(text: str) -> str:
    """Return a text for a comment, on one printable line.

    Args:
        text: any text.
    """
    line = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 3]}..."
