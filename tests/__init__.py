"""Tests. They run side by side: numerical libraries get one thread, as from the command line."""

from pipeline.__main__ import one_thread

one_thread()
