"""A short stage as a fork of a process with its libraries loaded, against the same one by itself."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.timing import side_by_side
from pipeline.preloaded import ADDRESS

PEER = "python -m pipeline without pipeline.preloaded"
PIPELINE = [sys.executable, "-m", "pipeline"]
ROOT = Path(__file__).parent.parent


def run() -> dict[str, float]:
    """What can be identified of the slider-crank from its 20 logs, three times each, after one of each."""
    command = ["bash", "-c", f"echo ${ADDRESS}; exec cat"]
    server = [sys.executable, "-m", "pipeline.preloaded", *command]
    pipe = subprocess.PIPE
    with (
        tempfile.TemporaryDirectory() as out,
        subprocess.Popen(server, cwd=ROOT, stdin=pipe, stdout=pipe, text=True) as process,
    ):
        assert process.stdin is not None and process.stdout is not None
        address = process.stdout.readline().strip()

        bench = [*PIPELINE, "acquire", "source=slider_crank", f"out={out}/logs"]
        subprocess.run(bench, cwd=ROOT, check=True)
        words = [
            "identifiability",
            "system=systems/slider_crank.yaml",
            f"logs={out}/logs",
            f"out={out}/found",
        ]

        def stage(**environment: str) -> None:
            environment = {**os.environ, **environment}
            subprocess.run([*PIPELINE, *words], cwd=ROOT, env=environment, capture_output=True, check=True)

        result = side_by_side(lambda: stage(**{ADDRESS: address}), stage, rounds=3)
        process.stdin.close()
    return result
