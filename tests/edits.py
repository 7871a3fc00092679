"""Contents of a stranger: every entry missing, or of another type."""

from collections.abc import Iterator
from typing import Any

#: What an entry is not.
WRONG = (None, "x", "\x1b[31m", -1, 0, 1e99, 1e308, [], {}, True, [1], {"a": 1}, [None, None])


def edits(content: Any) -> Iterator[Any]:
    """The content without each of its entries, and with each of `WRONG` in place of it."""
    if isinstance(content, dict):
        for key, value in content.items():
            yield {k: v for k, v in content.items() if k != key}
            yield from ({**content, key: new} for new in (*WRONG, *edits(value)))
    if isinstance(content, list):
        for k, value in enumerate(content):
            yield from ([*content[:k], new, *content[k + 1 :]] for new in (*WRONG, *edits(value)))
