"""The committed reference is what the code says."""

from functools import cache

from docs.reference import generate
from docs.reference.docstrings import of
from pipeline.__main__ import PROGRAM
from unmodelled.effects.library import effects

pages = cache(generate.pages)


def test_it_is_up_to_date() -> None:
    old = [name for name, text in pages().items() if (generate.HERE / name).read_text() != text]
    assert not old, f"{old}: make docs"


def test_every_key_of_every_verb_has_a_meaning() -> None:
    for verb in PROGRAM.verbs:
        found = of(PROGRAM.target(verb))
        lacking = set(found.parameters) - set(found.meanings())
        assert not lacking, (verb, lacking)
        assert f"\n## {verb}\n" in pages()["verbs.md"]


def test_every_law_and_every_config_is_there() -> None:
    rows = [line for line in pages()["effects.md"].splitlines() if line.startswith("| ")]
    assert sum(not line.startswith("| variant") for line in rows) == len(effects())
    chosen = [name for files in PROGRAM.groups().values() for name in files]
    assert all(f"| `{name}` |" in pages()["configs.md"] for name in chosen)


def test_meanings_that_share_a_line_are_told_apart() -> None:
    found = of("unmodelled.learning.windows.Windows").meanings()
    assert found["epochs"] == "passes over all windows."
    assert found["batch"] == "windows per mini-batch."
