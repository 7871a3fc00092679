"""The one exception that means "your input is wrong", as opposed to a fault of the program."""

from __future__ import annotations


class BadInput(Exception):
    """What a user handed over cannot be used; the message is one line that names file, row and column.

    The command line prints the message on standard error and exits with code 2.
    """
