"""The exception for unusable input, as opposed to a fault of the program."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from itertools import accumulate

#: Characters of a message: a screen of them. What a library says of a damaged file can quote the whole file.
LONGEST = 1000
#: Characters of a list of valid names in a message.
NAMES = 120


class BadInput(Exception):
    """Input of a user that cannot be used; the message is one line that names file, row and column.

    The command line prints the message on standard error and exits with code 2. Control characters in quoted
    input are escaped, so that a file cannot send commands to the terminal.

    Args:
        message: description of the fault (of the first one if there are several), and what to do about it.
        others: descriptions of further faults found together with it, one line each; default none.

    Examples:
        >>> raise BadInput("logs/run1.csv: row 3: omega is empty: write a number")
        Traceback (most recent call last):
            ...
        unmodelled.base.errors.BadInput: logs/run1.csv: row 3: omega is empty: write a number
    """

    def __init__(self, message: str, others: Sequence[str] = ()) -> None:
        super().__init__(_line(message))
        self.others = tuple(_line(other) for other in others)
        for other in self.others:  # a traceback, in a notebook for instance, shows notes
            self.add_note(f"also: {other}")


class Faults:
    """Collection of independent faults of one input, so that a user sees all of them at once."""

    def __init__(self) -> None:
        self._lines: list[str] = []

    def add(self, line: str) -> None:
        """Add a fault."""
        self._lines.append(line)

    @contextmanager
    def collected(self) -> Iterator[None]:
        """Collect the BadInput that the block raises, and continue after the block."""
        try:
            yield
        except BadInput as fault:
            self._lines += [str(fault), *fault.others]

    def __len__(self) -> int:
        return len(self._lines)

    def check(self) -> None:
        """Refuse the input if faults were collected."""
        if self._lines:
            raise BadInput(self._lines[0], self._lines[1:])


def nearest(name: str, known: Collection[str]) -> str | None:
    """Return the known name that a misspelt name probably stands for."""
    plain = {k.lower(): k for k in known}
    found = get_close_matches(name.lower(), plain, 1)
    return plain[found[0]] if found else None


def closest(name: str, known: Collection[str]) -> str:
    """Return the end of an error message about an unknown name: the probable name, or all valid ones.

    Examples:
        >>> closest("omga", ["theta", "omega"])
        "; did you mean 'omega'?"
        >>> closest("x", ["theta", "omega"])
        ', must be one of theta, omega'
    """
    near = nearest(name, known)
    if near is not None:
        return f"; did you mean {near!r}?"
    listed = accumulate(known, "{}, {}".format)
    shown = sum(len(text) <= NAMES for text in listed)
    more = f" and {len(known) - shown} more" if shown < len(known) else ""
    return f", must be one of {', '.join(list(known)[:shown])}{more}" if shown else ""


def first_line(error: Exception) -> str:
    """Return the first line of what a library says of a fault, or the name of the fault."""
    return (str(error).splitlines() or [type(error).__name__])[0]


def first_few(names: Sequence[str], most: int = 6) -> str:
    """Return names for a sentence, the first few if there are more.

    Examples:
        >>> first_few(["run1", "run2", "run3"], 3), first_few(["run1", "run2", "run3"], 1)
        ('run1, run2, run3', 'run1 and 2 more')
    """
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def printable(text: str) -> str:
    """Return a text with its control characters as escapes, so that a terminal shows it as it is."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def _line(text: str) -> str:
    """Return a text as one printable line; a very long text is cut in the middle."""
    line = printable(" ".join(part.strip() for part in text.splitlines()))
    return line if len(line) <= LONGEST else f"{line[: 2 * LONGEST // 3]} ... {line[-LONGEST // 4 :]}"
