"""The templates of pages, their style and their script."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

HERE = Path(__file__).parent
STATIC = HERE / "static"
#: Script that sets light or dark before a page is drawn.
THEME = (STATIC / "theme.js").read_text()

#: What stands at the head of a page about the data behind it.
ORIGINS = {
    "virtual": "Virtual campaign – simulated logs, not measurements",
    "measured": "Measured data",
    "both": "Measured data and virtual campaigns – every result says which",
    "": "No campaign yet – nothing was run",
}


def templates(*more: Path) -> Environment:
    """Return the templates of a diagnosis, and those of other folders that may build on them.

    Args:
        *more: folders of further templates.
    """
    made = Environment(
        loader=FileSystemLoader([HERE / "templates", *more]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.globals["theme"] = THEME
    return made


def policy(scripts: Iterable[str]) -> str:
    """Return the content security policy under which a browser runs some scripts and loads nothing else.

    Args:
        scripts: texts of the scripts of a page.
    """
    digests = (hashlib.sha256(script.encode()).digest() for script in scripts)
    allowed = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
