"""The rooms of the library, as their `__init__` describes them, as the table in ARCHITECTURE.md."""

from __future__ import annotations

import tomllib
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
BEGIN, END = "<!-- rooms: make docs -->\n", "<!-- end of rooms -->\n"
#: What stands before the names of rooms in the docstring of a room, and what stands for none.
MAY, NONE = "May import: ", "none"


class Room(NamedTuple):
    """A folder directly below the library, as its `__init__` describes it."""

    name: str
    contains: str  # one paragraph
    imports: tuple[str, ...]  # rooms that it may import


def rooms() -> list[Room]:
    """Return all rooms that describe themselves, from the lowest layer of import-linter to the highest."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (layers,) = (each["layers"] for each in contracts if each.get("containers") == ["unmodelled"])
    names = [name.strip() for layer in reversed(layers) for name in layer.split("|")]
    return [_room(name) for name in names if name != "__main__"]


def _room(name: str) -> Room:
    text = " ".join((import_module(f"unmodelled.{name}").__doc__ or "").split())
    contains, _, imports = text.rpartition(MAY)
    found = [each for each in imports.removesuffix(".").split(", ") if each != NONE]
    return Room(name, contains.strip(), tuple(found))


def table() -> str:
    """Return the table of the rooms."""
    lines = ["| `unmodelled/` | contains | may import |", "|---|---|---|"]
    lines += [f"| `{r.name}` | {r.contains} | {', '.join(f'`{i}`' for i in r.imports)} |" for r in rooms()]
    return "\n".join(lines) + "\n"


def page() -> str:
    """Return ARCHITECTURE.md with the table of the rooms."""
    text = (ROOT / "ARCHITECTURE.md").read_text()
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}{table()}{END}{rest.partition(END)[2]}"
