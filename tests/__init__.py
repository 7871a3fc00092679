"""Tests. They run side by side: numerical libraries get one thread, as from the command line."""

from unmodelled.base.workers import one_thread

one_thread()
