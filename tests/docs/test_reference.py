"""The committed reference is what the code says."""

from __future__ import annotations

import pytest

from docs.reference.docstrings import of
from docs.reference.generate import HERE, pages
from pipeline.__main__ import PROGRAM
from unmodelled.effects.library import effects

PAGES = pages()


@pytest.mark.parametrize("name", PAGES)
def test_it_is_up_to_date(name: str) -> None:
    assert (HERE / name).read_text() == PAGES[name], "make docs"


def test_every_key_of_every_verb_has_a_meaning() -> None:
    for verb in PROGRAM.verbs:
        found = of(PROGRAM.target(verb))
        lacking = set(found.parameters) - set(found.meanings())
        assert not lacking, (verb, lacking)
        assert f"\n## {verb}\n" in PAGES["verbs.md"]


def test_every_law_and_every_config_is_there() -> None:
    rows = [line for line in PAGES["effects.md"].splitlines() if line.startswith("| ")]
    assert sum(not line.startswith("| variant") for line in rows) == len(effects())
    chosen = [name for files in PROGRAM.groups().values() for name in files]
    assert all(f"| `{name}` |" in PAGES["configs.md"] for name in chosen)


def test_meanings_that_share_a_line_are_told_apart() -> None:
    found = of("unmodelled.learning.windows.Windows").meanings()
    assert found["epochs"] == "passes over all windows."
    assert found["batch"] == "windows per mini-batch."
