"""Keep a finished answer, a picture of its page and a notebook with its outputs: `make docs`."""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from nbclient import NotebookClient
from playwright.sync_api import sync_playwright

import unmodelled as um

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGE, PICTURE = DOCS / "answer" / "pendulum.html", DOCS / "images" / "answer.png"
NOTEBOOK, EXECUTED = DOCS / "notebooks" / "own_machine.ipynb", DOCS / "answer" / "own_machine.ipynb"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def build(file: Path) -> None:
    """Diagnose the pendulum that comes with the library, and write the page of the answer, one HTML file."""
    with TemporaryDirectory() as folder:
        um.diagnose(*um.example("pendulum")).save(Path(folder) / "answer")
        text = (Path(folder) / "answer" / "index.html").read_text()
    file.parent.mkdir(exist_ok=True)
    file.write_text(text.replace(f"{ROOT}/", ""))


def photograph(file: Path, picture: Path) -> None:
    """Take a picture of the page from its head to the sliders."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    with (
        sync_playwright() as playwright,
        playwright.chromium.launch(executable_path=found, args=["--no-sandbox", "--disable-gpu"]) as browser,
    ):
        page = browser.new_page(viewport={"width": 1180, "height": 1400}, color_scheme="light")
        page.goto(file.as_uri())
        plot = page.locator("#live-machine .uplot").first
        plot.wait_for()
        places = page.locator("main"), page.locator("#verdict"), plot
        main, top, last = (place.bounding_box() for place in places)
        assert main and top and last
        page.screenshot(
            path=picture,
            full_page=True,
            clip={
                "x": main["x"] - 12,
                "y": top["y"] - 12,
                "width": main["width"] + 24,
                "height": last["y"] + last["height"] - top["y"] + 24,
            },
        )


def execute(notebook: Path, to: Path) -> None:
    """Run all cells of a notebook, and write it with its outputs."""
    cells = nbformat.read(notebook, as_version=4)  # type: ignore[no-untyped-call]
    with TemporaryDirectory() as folder:
        where = {"metadata": {"path": folder}}
        NotebookClient(cells, timeout=300, record_timing=False, resources=where).execute()
    nbformat.write(cells, to)  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    build(PAGE)
    photograph(PAGE, PICTURE)
    execute(NOTEBOOK, EXECUTED)
    print(f"open file://{PAGE}")
