"""Keras in a program of its own, which does one training step for every line that it is sent.

TensorFlow asks for an older h5py than constraints.txt pins, so the programs in `peers` run with the Python
that BENCH_KERAS_PYTHON names and else with this one:

    python3.11 -m venv keras && keras/bin/pip install keras tensorflow-cpu
    BENCH_KERAS_PYTHON=keras/bin/python make bench

Without constraints.txt the extra `bench` of pyproject.toml installs them beside the pipeline.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.timing import PeerMissing

PYTHON = os.environ.get("BENCH_KERAS_PYTHON", sys.executable)


@contextmanager
def started(program: str, folder: Path, how: str) -> Iterator[subprocess.Popen[str]]:
    """`peers/<program>.py` with its task in `folder`; its first answer is its version."""
    command = [PYTHON, str(Path(__file__).parent / "peers" / f"{program}.py"), str(folder), how]
    if subprocess.run([PYTHON, "-c", "import keras, tensorflow"], capture_output=True).returncode:
        raise PeerMissing(
            f"{PYTHON} has no Keras with TensorFlow: set BENCH_KERAS_PYTHON to a Python that has"
        )
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as peer:
        try:
            yield peer
        finally:
            if peer.stdin:
                peer.stdin.close()


def step(peer: subprocess.Popen[str]) -> None:
    """One training step."""
    assert peer.stdin is not None
    peer.stdin.write("\n")
    peer.stdin.flush()
    answer(peer)


def answer(peer: subprocess.Popen[str]) -> str:
    """The next line of the peer."""
    assert peer.stdout is not None
    line = peer.stdout.readline().strip()
    if not line:
        raise RuntimeError("the Keras peer ended early; its own message stands above")
    return line
