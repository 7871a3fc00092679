"""Colour only where a terminal has it."""

import io

import pytest

from unmodelled.cli.colour import coloured

TEXT = "verdict: an effect (confidence 0.90)\n- Dry friction at joint: F_c\nnote: theta was unwrapped"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_first_words_have_a_colour_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    verdict, effect, note = coloured(TEXT, Terminal()).splitlines()
    assert verdict == "\x1b[1mverdict:\x1b[0m an effect (confidence 0.90)"
    assert effect == "- Dry friction at joint: F_c" and note.startswith("\x1b[33mnote:\x1b[0m theta")


@pytest.mark.parametrize("variables", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
def test_who_wants_none_gets_none(variables: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert coloured(TEXT, Terminal()) == TEXT


def test_a_file_gets_none() -> None:
    assert coloured(TEXT, io.StringIO()) == TEXT
