"""A browser for the tests of pages, which the folders that have pages import into their conftest.

REPORT_BROWSER=required fails where no browser is.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

CHECKS = (Path(__file__).parent / "report" / "checks.js").read_text()
DESKTOP = {"width": 1440, "height": 900}
BROWSER_FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"]
BROWSER_FLAGS += ["--disable-background-networking", "--disable-component-update"]


@pytest.fixture(scope="module")  # its event loop would be in the way of other tests
def browser() -> Iterator[Browser]:
    names = ("chromium", "chromium-browser", "google-chrome")
    path = next((found for name in names if (found := shutil.which(name))), None)
    if path is None:
        missing = f"no browser: none of {', '.join(names)} is installed"
        if os.environ.get("REPORT_BROWSER") == "required":
            pytest.fail(missing)
        pytest.skip(missing)
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=BROWSER_FLAGS)
        yield opened
        opened.close()


def watched(page: Page) -> list[str]:
    """Complaints of the browser about a page, requests that fail and requests to a network, as they come."""
    wrong: list[str] = []
    page.add_init_script(CHECKS)
    page.on(
        "console", lambda m: wrong.append(f"{m.type}: {m.text}") if m.type in ("error", "warning") else None
    )
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("requestfailed", lambda request: wrong.append(f"failed: {request.url}"))
    page.on("request", lambda r: None if r.url.startswith(("file:", "data:")) else wrong.append(r.url))
    return wrong


@contextmanager
def opened(browser: Browser, file: Path, **options: Any) -> Iterator[Page]:
    """A page from disk, about which the browser must not complain until the end of the block."""
    with browser.new_context(**{"viewport": DESKTOP, **options}) as context:
        page = context.new_page()
        wrong = watched(page)
        page.goto(file.as_uri())
        yield page
        assert not wrong, "\n".join(wrong)


def faults(page: Page, *checks: str) -> list[str]:
    """What is broken, hidden or hard to read on a page; by default all of it."""
    names = checks or ("images", "overflows", "illegible")
    return [what for name in names for what in page.evaluate(f"checks.{name}()")]
