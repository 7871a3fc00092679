"""Texts of the drafted files and of the terminal: names, texts in quotes, comments on one line."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import TypeVar

import yaml

T = TypeVar("T")
#: Characters of a text from the logs in a comment.
LONGEST = 120
_PLAIN = re.compile(r"[A-Za-z][\w./^]*(?: [\w./^]+)*", re.ASCII)


def numbered(parts: Sequence[T]) -> Iterator[tuple[str, T]]:
    """Yield joints or balances with the numbers of their symbols; a single one has none."""
    for k, part in enumerate(parts, start=1):
        yield (str(k) if len(parts) > 1 else ""), part


def word(text: str) -> str:
    """Return a name for a system file.

    Examples:
        >>> word("day 1 (north)"), word("2026-11-25")
        ('day_1_north', 'machine_2026_11_25')
    """
    found = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "machine"
    return found if found[0].isalpha() else f"machine_{found}"


def system_file(comments: Sequence[str], name: str, sections: Mapping[str, Sequence[str]]) -> str:
    """Return the text of a system file: comments, its name, and the sections that have lines."""
    head = [*(f"# {each}" for each in comments), "schema: system/1", f"name: {word(name)}"]
    body = [line for key, lines in sections.items() if lines for line in (f"{key}:", *lines)]
    return "\n".join([*head, *body]) + "\n"


def one_line(text: str) -> str:
    """Return a text for a comment, on one printable line."""
    line = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 3]}..."


def quoted(text: str) -> str:
    """Return a text for a YAML file, in quotes with escapes unless it can stand there as it is."""
    if _PLAIN.fullmatch(text) and yaml.safe_load(text) == text:
        return text
    return str(yaml.dump(text, default_style='"', allow_unicode=True, width=sys.maxsize)).rstrip("\n")


def identified(value: float, unit: str, bounds: tuple[float, float] | None = None) -> str:
    """Return an entry of an uncertain parameter, by default between a tenth of its value and ten times it.

    Examples:
        >>> identified(0.02, "kg m^2")
        '{value: 0.02, unit: kg m^2, identify: true, bounds: [0.002, 0.2]}'
    """
    low, high = bounds or (value / 10.0, 10.0 * value)
    return f"{{value: {value:.3g}, unit: {quoted(unit)}, identify: true, bounds: [{low:.3g}, {high:.3g}]}}"
