"""How often a planted law that the library lacks is written down; prints a table for docs/decisions.

    python -m tests.diagnosis.discoveries [first] [last]

Carts on a spring with one planted force each, as in `test_carts`, with sizes drawn anew for every
number. A formula predicts as well as the truth if its gap on held-out experiments is at most 1.1 times the
noise floor.
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.diagnosis.test_carts import CART, Force, record
from tests.machines.folders import diagnosed

#: Planted forces, N, by size: of terms that are tried, of other forms, and of the library.
TERMS: tuple[Callable[[float], Force], ...] = (
    lambda a: lambda x, v: 0.8 * a * v**3,
    lambda a: lambda x, v: 0.6 * a * v * abs(v) + 0.8 * v**3,
    lambda a: lambda x, v: 12.0 * a * x**2 * v,
    lambda a: lambda x, v: 1.2 * a * v + 60.0 * a * x**3 + 90.0 * x**5,
    lambda a: lambda x, v: 1.0 * a * v + 10.0 * x**2 * v,
    lambda a: lambda x, v: 20.0 * a * x**2 + 2.0 * v,
)
OTHERS: tuple[Callable[[float], Force], ...] = (
    lambda a: lambda x, v: 6.0 * a * v / (1.0 + (v / 0.5) ** 2),
    lambda a: lambda x, v: 8.0 * a * x * float(np.exp(-((x / 0.15) ** 2))),
    lambda a: lambda x, v: 2.0 * a * float(np.sign(v)) * abs(v) ** 1.5,
    lambda a: lambda x, v: 3.0 * a * v * float(np.exp(2.0 * x)),
    lambda a: lambda x, v: 4.0 * a * float(np.tanh(4.0 * x)),
    lambda a: lambda x, v: 2.0 * a * v * (1.0 + float(np.cos(9.0 * x))),
)
LIBRARY: tuple[Callable[[float], Force], ...] = (
    lambda a: lambda x, v: 0.0,
    lambda a: lambda x, v: 2.0 * a * v * abs(v),
    lambda a: lambda x, v: 1.5 * a * float(np.tanh(v / 0.01)),
    lambda a: lambda x, v: 2.0 * a * v + 1.0 * float(np.tanh(v / 0.01)),
    lambda a: lambda x, v: 80.0 * a * x**3,
    lambda a: lambda x, v: 6.0 * a * x,
)
KINDS = {"term": TERMS, "other": OTHERS, "library": LIBRARY}


def main(first: int, last: int) -> None:
    for number in range(first, last):
        for kind, forces in KINDS.items():
            size = float(np.exp(np.random.default_rng([number, len(kind)]).uniform(-0.5, 0.5)))
            force = forces[number % len(forces)](size)
            with tempfile.TemporaryDirectory() as place:
                folder = Path(place)
                answer = diagnosed(folder, CART, record(folder / "logs", force, number))
            gap = answer.content["gap"]
            said = " + ".join(f"{e.family} ({e.law})" for e in answer.effects) or "nothing"
            ratio = gap["augmented"] / gap["floor"]
            print(f"{kind} {number}: {answer.verdict}, {ratio:.2f} times the floor: {said}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:] or (0, 20)))
