"""Every law of speed, time, inputs, outputs and parameters, from logs to the page."""

import pytest
from playwright.sync_api import Browser

from tests.stages.planted_law import Diagnosed, along_travel, check_in_browser, check_law, laws
from tests.stages.planted_law import diagnosed as diagnosed

pytestmark = pytest.mark.long

MINE = [name for name, law in laws().items() if not along_travel(law)]


@pytest.mark.parametrize("name", MINE)
def test_a_planted_law_is_named_and_its_answer_is_whole(name: str, diagnosed: Diagnosed) -> None:
    check_law(name, diagnosed)


def test_every_page_opens_in_a_browser(browser: Browser, diagnosed: Diagnosed) -> None:
    check_in_browser(browser, [diagnosed(name) for name in MINE])
