"""Build pages on the public functions from their docstrings: `make docs`, or python -m docs.api_pages."""

from __future__ import annotations

import shutil
import warnings
from pathlib import Path

import pdoc
import pdoc.render

FOLDER = Path(__file__).parent / "api"
#: Packages that only the library itself uses. (Also, pdoc cannot read the annotations of the NamedTuples in
#: `engine.machine`.)
INTERNAL = ("base", "cli", "conf", "engine.machine")


def build(folder: Path) -> None:
    """Write one HTML page per public module of the library, an index and a search index.

    Args:
        folder: folder of the pages; an existing folder is replaced.

    Raises:
        UserWarning: when a module cannot be imported, or a docstring or annotation cannot be read.
    """
    shutil.rmtree(folder, ignore_errors=True)
    pdoc.render.configure(docformat="google", footer_text="unmodelled", show_source=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        pdoc.pdoc("unmodelled", *(f"!unmodelled.{name}" for name in INTERNAL), output_directory=folder)


if __name__ == "__main__":
    build(FOLDER)
    print(f"open file://{FOLDER / 'index.html'}")
