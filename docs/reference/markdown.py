"""Write Markdown tables, code and values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import yaml


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table, or an empty text if there are no rows."""
    lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    if not lines:
        return ""
    return "\n".join([f"| {' | '.join(head)} |", "|" + "---|" * len(head), *lines]) + "\n"


def code(text: object) -> str:
    """Return the text in backticks."""
    return f"`{text}`" if str(text) else ""


def comment(path: Path) -> str:
    """Return the comment at the top of a YAML file on one line; empty if there is none."""
    found = re.match(r"((?:#.*\n)+)", path.read_text())
    return " ".join(line.lstrip("# ").rstrip() for line in found[1].splitlines()) if found else ""


def value(content: object) -> str:
    """Return a value as written on the command line."""
    text = yaml.safe_dump(content, default_flow_style=True, width=1000, sort_keys=False)
    return text.strip().removesuffix("\n...").strip()
