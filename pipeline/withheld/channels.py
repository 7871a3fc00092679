"""Determine the channels at which a parameter acts."""

from collections.abc import Iterator

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.systems.model import System, symbol
from unmodelled.systems.numeric import numpy_system_function

#: States at which influences are compared.
_POINTS = 64
#: Relative, of influences that are the same but for rounding.
_CLOSE = 1e-9


def parameter_channels(system: System) -> dict[str, frozenset[str]]:
    """Find the channels at which every parameter of a system acts.

    A parameter whose influence on the rates of the states contains no input acts at every port whose effort
    has a proportional influence, like a damping. A parameter whose influence contains an input, and is zero
    at rest without this input, acts at this input, like a motor constant. Other parameters, such as masses,
    act at no channel.

    Examples:
        >>> from pathlib import Path
        >>> from unmodelled.systems.reader import read_system
        >>> parameter_channels(read_system(Path("systems/pendulum.yaml")))["parameter:b"]
        frozenset({'joint'})
    """
    return {f"parameter:{p.name}": frozenset(_channels(system, symbol(p.name))) for p in system.parameters}


def _channels(system: System, parameter: sp.Symbol) -> Iterator[str]:
    influence = _influence(system, parameter)
    inputs = [u for u in system.u if any(f.has(u) for f in influence)]
    for u in inputs:
        if not np.any(_values(system, influence, still=True)):
            yield f"actuator:{u.name}"
    if inputs:
        return
    own = _values(system, influence)
    for port in system.ports:
        effort = _values(system, _influence(system, symbol(port.effort)))
        if np.any(own) and _proportional(own, effort):
            yield port.name


def _influence(system: System, by: sp.Symbol) -> list[sp.Expr]:
    return [sp.diff(rate, by) for rate in system.dynamics]


def _values(system: System, expressions: list[sp.Expr], still: bool = False) -> Array:
    """(points, states) at random states, or `still`: those at which no position changes, without inputs."""
    rng = np.random.default_rng(0)
    x = rng.uniform(-1.0, 1.0, (_POINTS, len(system.states)))
    u = rng.uniform(-1.0, 1.0, (_POINTS, len(system.inputs)))
    if still:
        u[:] = 0.0
        x[:, [k for k, state in enumerate(system.x) if state in system.dynamics]] = 0.0
    c = rng.uniform(0.5, 1.5, (_POINTS, len(system.operating_point)))
    function = numpy_system_function(system, expressions, efforts_zero=True)
    return function(0.0, x, u, np.empty(0), np.array(system.values), c)


def _proportional(a: Array, b: Array) -> bool:
    """Whether rows of `a` are multiples of those of `b`."""
    rest = a - b * (np.sum(a * b, axis=1) / np.maximum(np.sum(b * b, axis=1), np.finfo(float).tiny))[:, None]
    return bool(np.all(np.abs(rest) <= _CLOSE * np.abs(a).max()))
