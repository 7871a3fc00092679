"""The templates of pages, their style and their script."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from unmodelled.engine.machine.javascript import SCRIPT

HERE = Path(__file__).parent
STATIC = HERE / "static"
#: Script that sets light or dark before a page is drawn.
THEME = (STATIC / "theme.js").read_text()

#: Scripts of the machine in a page, in the order in which they need each other.
LIVE_SCRIPTS = (
    *(STATIC / "uplot.min.js", SCRIPT),
    *(STATIC / f"{name}.js" for name in ("simulation", "format", "plots", "live")),
)

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


def one_file(template: str, scripts: Sequence[str] = ("report",), live: str = "", **values: Any) -> str:
    """Return a page that is one file: it contains its style and scripts, and loads nothing.

    Args:
        template: name of a template that builds on page.html.j2.
        scripts: names of the page's own scripts, default that of every page.
        live: data block of the machine that the page simulates, default none.
        **values: further values of the template.
    """
    styles = ("uplot.min", "style") if live else ("style",)
    paths = (*(LIVE_SCRIPTS if live else ()), *(STATIC / f"{name}.js" for name in scripts))
    texts = [path.read_text() for path in paths]
    inside = {
        "style": "\n".join((STATIC / f"{name}.css").read_text() for name in styles),
        "scripts": texts,
        "live": live,
        "uplot_licence": (STATIC / "uplot.LICENSE.txt").read_text() if live else "",
        "policy": policy([THEME, *texts]),
    }
    return templates().get_template(template).render(**values, **inside, root="")
