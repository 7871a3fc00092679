"""Every law that depends on a position, from logs to the page."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from tests.stages.planted_law import (
    Diagnosed,
    along_travel,
    check_answer,
    check_in_browser,
    check_page,
    diagnosing,
    laws,
)

pytestmark = pytest.mark.long

MINE = [name for name, law in laws().items() if along_travel(law)]


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Diagnosed]:
    yield from diagnosing(tmp_path_factory.mktemp("laws"))


@pytest.mark.parametrize("name", MINE)
def test_a_planted_law_is_named_and_its_answer_is_whole(name: str, diagnosed: Diagnosed) -> None:
    folder = diagnosed(name)
    content, law = check_answer(folder), laws()[name]
    named = [(effect["family"], effect.get("variant", "")) for effect in content["effects"]]
    assert named == [(law.family, law.variant)]
    check_page(folder)


def test_every_page_opens_in_a_browser(browser: Browser, diagnosed: Diagnosed) -> None:
    check_in_browser(browser, [diagnosed(name) / "out" / "index.html" for name in MINE])
