"""Systems of the files in `systems/`, their logs and numbers, and the lines that refuse bad input."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from numpy.typing import ArrayLike

from unmodelled import BadInput, Logs, System, read_logs, read_system, write_system
from unmodelled.base.arrays import Array
from unmodelled.systems.numeric import numpy_system_function

SYSTEMS = Path(__file__).parents[2] / "systems"
NAMES = sorted(path.stem for path in SYSTEMS.glob("*.yaml"))
#: A system without any parts, for `replace`.
EMPTY = System("made", (), (), (), (), (), (), (), {}, ())


@cache
def built_in(name: str) -> System:
    """The system of `systems/<name>.yaml`."""
    return read_system(SYSTEMS / f"{name}.yaml")


def written_again(system: System, folder: Path) -> System:
    """What is read of a system that was written."""
    write_system(system, folder / "written" / "a b.yaml")
    return read_system(folder / "written" / "a b.yaml")


def recorded(campaign: Any, name: str, folder: Path, seed: int = 0) -> tuple[System, Logs]:
    """The system of `systems/<name>.yaml`, and the logs that a bench writes to `folder`."""
    campaign.write(folder / "logs", seed)
    return built_in(name), read_logs(folder / "logs", built_in(name))


def values_of(
    system: System,
    expressions: Iterable[sp.Expr],
    x: ArrayLike,
    u: ArrayLike = (),
    c: ArrayLike = (),
    p: ArrayLike | None = None,
    e: ArrayLike | None = None,
    t: ArrayLike = 0.0,
) -> Array:
    """Values of expressions of a system, with its own parameters and no efforts unless they are given."""
    function = numpy_system_function(system, list(expressions), efforts_zero=e is None)
    given = (x, u, () if e is None else e, system.values if p is None else p, c)
    return function(t, *(np.asarray(value, float) for value in given))


def runge_kutta(rates: Callable[[float, Array], Array], x: Array, t: Array) -> Array:
    """States from x on at the times t, one step of the method of Runge and Kutta between them."""
    path = [x]
    for now, then in pairwise(t):
        h = then - now
        k1 = rates(now, x)
        k2 = rates(now + h / 2, x + h / 2 * k1)
        k3 = rates(now + h / 2, x + h / 2 * k2)
        x = x + h / 6 * (k1 + 2 * (k2 + k3) + rates(then, x + h * k3))
        path.append(x)
    return np.array(path)


def refusals(read: Callable[[], object]) -> list[str]:
    """All lines for which what is read is refused."""
    with pytest.raises(BadInput) as caught:
        read()
    return [str(caught.value), *caught.value.others]
