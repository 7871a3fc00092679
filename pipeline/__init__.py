"""The dissertation on the library `unmodelled`, as a pipeline of stages.

`from pipeline import diagnose, simulate, train` are the verbs as functions, for a notebook.
"""

from importlib import import_module
from typing import Any

VERBS = ("diagnose", "evaluate", "identifiability", "simulate", "train")


def __getattr__(name: str) -> Any:
    # imported when it is asked for: `python -m pipeline --help` loads no library
    if name not in VERBS:
        raise AttributeError(f"module 'pipeline' has no attribute {name!r}")
    return getattr(import_module(f"pipeline.stages.{name}"), name)
