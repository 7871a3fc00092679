"""Verbs of the command line: every file is one, and calls one function of the library."""
