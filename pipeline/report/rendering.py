"""The templates of all pages."""

from __future__ import annotations

from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

HERE = Path(__file__).parent
STATIC = HERE / "static"

#: What stands at the head of a page about the data behind it.
ORIGINS = {
    "virtual": "Virtual campaign – simulated logs, not measurements",
    "measured": "Measured data",
    "both": "Measured data and virtual campaigns – every result says which",
    "": "No campaign yet – nothing was run",
}


def templates() -> Environment:
    """The templates of all pages."""
    return Environment(
        loader=FileSystemLoader(HERE / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
