"""The one exception that means "your input is wrong", as opposed to a fault of the program."""

from __future__ import annotations


class BadInput(Exception):
    """What a user handed over cannot be used; the message is one line that names file, row and column.

    The command line prints the message on standard error and exits with code 2. Whatever it quotes, it is
    printable: a file cannot write to the terminal.
    """

    def __init__(self, message: str) -> None:
        lines = " ".join(part.strip() for part in message.splitlines())
        super().__init__("".join(c if c.isprintable() else repr(c)[1:-1] for c in lines))
