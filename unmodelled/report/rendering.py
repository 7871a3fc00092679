"""The templates of pages, their style and their script."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from unmodelled.base.errors import BadInput
from unmodelled.base.limits import check_file

HERE = Path(__file__).parent
STATIC = HERE / "static"
#: Script that sets light or dark before a page is drawn.
THEME = (STATIC / "theme.js").read_text()

#: Scripts of the machine in a page, in the order in which they need each other.
LIVE_SCRIPTS = (
    *(STATIC / f"{name}.js" for name in ("uplot.min", "machine", "simulation", "format", "plots", "live")),
)

#: Characters in which a page says what made it.
HEAD = 4000
#: What stands at the head of a page about the data behind it.
ORIGINS = {
    "virtual": "Virtual campaign – simulated logs, not measurements",
    "measured": "Measured data",
    "both": "Measured data and virtual campaigns – every result says which",
    "": "No campaign yet – nothing was run",
}


def templates(*more: Path) -> Environment:
    """Return the templates of a diagnosis, and those of other folders that may build on them."""
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


def check_own_page(file: Path, generator: str, verb: str) -> None:
    """Refuse to replace a page that another program or a user made."""
    check_file(file)
    try:
        made = generator in file.read_text(errors="replace")[:HEAD]
    except FileNotFoundError:
        return
    except OSError as error:
        raise BadInput(f"{file}: cannot be replaced: {error.strerror}: give another folder") from None
    if not made:
        raise BadInput(f"{file}: was not made by {verb}: give another folder with out=...")


def policy(scripts: Iterable[str]) -> str:
    """Return the content security policy under which a browser runs some scripts and loads nothing else."""
    digests = (hashlib.sha256(script.encode()).digest() for script in scripts)
    allowed = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def one_file(template: str, scripts: Sequence[str] = ("report",), live: str = "", **values: Any) -> str:
    """Return a page that is one file: it contains its style and scripts, and loads nothing."""
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
