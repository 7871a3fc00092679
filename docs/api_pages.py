"""Build pages on the public functions from their docstrings: `make docs`, or python -m docs.api_pages."""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import get_type_hints

import pdoc
import pdoc.extract
import pdoc.render

import unmodelled

FOLDER = Path(__file__).parent / "api"
#: Packages that only the library itself uses.
INTERNAL = ("base", "cli", "conf")
MODULES = ("unmodelled", *(f"!unmodelled.{name}" for name in INTERNAL))


def build(folder: Path) -> None:
    """Write one HTML page per public module of the library, an index and a search index, in a new folder.

    A module that cannot be imported, or a docstring or annotation that cannot be read, is an error.
    """
    shutil.rmtree(folder, ignore_errors=True)
    pdoc.render.configure(docformat="google", footer_text="unmodelled", show_source=False)
    with _rooms_listed(), warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        # members that a table has from pandas: their annotations name what it imports for type checkers alone
        warnings.filterwarnings("ignore", r"Error parsing type annotation .+ for pandas\.", UserWarning)
        for name in pdoc.extract.walk_specs(MODULES):
            _prepare(name)
        pdoc.pdoc(*MODULES, output_directory=folder)


@contextmanager
def _rooms_listed() -> Iterator[None]:
    """Name the rooms beside the functions of the package: pdoc shows nothing that `__all__` leaves out."""
    names = unmodelled.__all__
    rooms = {room.name for room in iter_modules(unmodelled.__path__)} - {*INTERNAL, "__main__"}
    unmodelled.__all__ = sorted({*names, *rooms})
    try:
        yield
    finally:
        unmodelled.__all__ = names


def _prepare(module: str) -> None:
    """Resolve what pdoc cannot: names that are imported on their first use, annotations of NamedTuples."""
    loaded = import_module(module)
    for name in getattr(loaded, "__all__", ()):
        setattr(loaded, name, getattr(loaded, name))
    for item in vars(loaded).values():
        if isinstance(item, type) and issubclass(item, tuple) and hasattr(item, "_fields"):
            item.__new__.__annotations__ = get_type_hints(item)


if __name__ == "__main__":
    build(FOLDER)
    print(f"open file://{FOLDER / 'index.html'}")
