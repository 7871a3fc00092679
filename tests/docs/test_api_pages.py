"""The pages on the library's functions are built from the docstrings, without warnings or a network."""

import re
from pathlib import Path

import pytest

import unmodelled as um
from docs.api_pages import INTERNAL, build

pytestmark = pytest.mark.long

LIBRARY = Path(__file__).parents[2] / "unmodelled"
ROOMS = {init.parent.name for init in LIBRARY.glob("*/__init__.py")}


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pages")
    build(folder)
    return folder


def test_every_public_room_has_a_page(pages: Path) -> None:
    assert {page.stem for page in (pages / "unmodelled").glob("*.html")} == ROOMS - set(INTERNAL)


def test_the_page_of_the_library_holds_all_public_names(pages: Path) -> None:
    page = (pages / "unmodelled.html").read_text()
    assert {name for name in um.__all__ if f'<section id="{name}"' not in page} == set()


def test_sections_of_docstrings_are_told_apart(pages: Path) -> None:
    reader = (pages / "unmodelled" / "systems" / "reader.html").read_text()
    assert "read_system" in reader and "Raises:</h6>" in reader


def test_no_page_loads_anything_from_a_network(pages: Path) -> None:
    loaded = re.compile(r"<(?:script|link|img)[^>]*(?:src|href)=[\"'](?:https?:)?//")
    assert not [page for page in pages.rglob("*.html") if loaded.search(page.read_text())]
