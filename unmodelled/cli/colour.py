"""Colour of the first word of a line, where the terminal has it."""

from __future__ import annotations

import os
from typing import TextIO

#: Codes (ECMA-48) by the word before the colon with which a line begins.
CODES = {"error": "1;31", "also": "31", "note": "33", "verdict": "1", "next": "1;36"}


def coloured(text: str, stream: TextIO) -> str:
    """Return lines for a stream with their first words in colour.

    A file, a pipe, a terminal without colour and the variable NO_COLOR (no-color.org) get the text as it is.
    """
    if not stream.isatty() or os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return text
    return "\n".join(map(_line, text.splitlines()))


def _line(line: str) -> str:
    word, colon, rest = line.partition(":")
    code = CODES.get(word) if colon else None
    return line if code is None else f"\x1b[{code}m{word}:\x1b[0m{rest}"
