"""Tests. They run side by side: numerical libraries get one thread, as from the command line."""

import os
from pathlib import Path

from unmodelled.base.workers import limit_threads

limit_threads()
# `python -m pipeline` runs from the checkout alone; tests start it in other folders
_BEFORE = os.environ.get("PYTHONPATH")
os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parents[1]), *([_BEFORE] if _BEFORE else [])])
