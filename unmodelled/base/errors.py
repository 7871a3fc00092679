"""The one exception that means "your input is wrong", as opposed to a fault of the program."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches

#: Characters of a message: a screen of them. What a library says of a damaged file can quote the whole file.
LONGEST = 1000


class BadInput(Exception):
    """What a user handed over cannot be used; the message is one line that names file, row and column.

    The command line prints the message on standard error and exits with code 2. Whatever it quotes, it is
    printable: a file cannot write to the terminal.

    Args:
        message: the fault, or the first of several.
        others: further faults that were found with it, a line each; default none.
    """

    def __init__(self, message: str, others: Sequence[str] = ()) -> None:
        super().__init__(_line(message))
        self.others = tuple(_line(other) for other in others)
        for other in self.others:  # a traceback, in a notebook for instance, shows notes
            self.add_note(f"also: {other}")


class Faults:
    """Collect independent faults of one input, so that a user hears of all of them at once."""

    def __init__(self) -> None:
        self._lines: list[str] = []

    def add(self, line: str) -> None:
        """Keep a fault and go on."""
        self._lines.append(line)

    @contextmanager
    def collected(self) -> Iterator[None]:
        """Keep the BadInput that the block raises, and go on after the block."""
        try:
            yield
        except BadInput as fault:
            self._lines += [str(fault), *fault.others]

    def check(self) -> None:
        """Refuse the input if there was a fault.

        Raises:
            BadInput: the first fault, with the others below it.
        """
        if self._lines:
            raise BadInput(self._lines[0], self._lines[1:])


def nearest(name: str, known: Collection[str]) -> str | None:
    """Return the one of `known` that `name` was probably meant to be, upper case or not; None without one."""
    plain = {k.lower(): k for k in known}
    found = get_close_matches(name.lower(), plain, 1)
    return plain[found[0]] if found else None


def closest(name: str, known: Collection[str]) -> str:
    """Return how an error message goes on after an unknown `name`."""
    near = nearest(name, known)
    if near is not None:
        return f"; did you mean {near!r}?"
    return f", must be one of {', '.join(known)}" if len(known) <= 40 else ""


def _line(text: str) -> str:
    """Text on one line, every character of it printable; of a very long one, its start and its end."""
    lines = " ".join(part.strip() for part in text.splitlines())
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in lines)
    return line if len(line) <= LONGEST else f"{line[: 2 * LONGEST // 3]} ... {line[-LONGEST // 4 :]}"
