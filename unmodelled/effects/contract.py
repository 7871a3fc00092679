"""What every law must keep, those of the library and those of a user, at every place of a system."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput
from unmodelled.effects.added import Added
from unmodelled.effects.effect import Effect
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales
from unmodelled.systems.model import System, symbol
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.reader import read_system
from unmodelled.systems.units import parse_unit
from unmodelled.systems.writer import write_system

#: Random states at which two texts of a system are compared, and their relative difference by rounding.
POINTS, ROUNDING = 40, 1e-9


def check_effect(effect: Effect, system: System, place: Place, scales: Scales) -> Added:
    """Return the system with an effect, after checks of what every effect must keep."""
    try:
        added = effect.add(system, place, scales)
        _check_zero(added, system)
        _check_numbers(added, system)
        _check_written(added.system)
    except (ValueError, AssertionError) as fault:
        raise BadInput(f"law {effect.family}: at {place.channel}: {fault}") from None
    return added


def _check_zero(added: Added, known: System) -> None:
    """At size zero, equations, outputs and states are those without the effect."""
    zero = {symbol(name): sp.S.Zero for name in added.amplitudes}
    _ask(not any(slope.xreplace(zero) for slope in added.slopes.values()), "slopes are left at size zero")
    zero |= {symbol(name): sp.S.Zero for name in added.slopes}
    grown, kept = added.system, slice(len(known.states))
    rates = tuple(f.xreplace(zero) for f in grown.closed[kept])
    _ask(rates == known.closed, "it changes the equations at size zero")
    shown = [o.expression.xreplace(zero) for o in grown.outputs]
    _ask(shown == [o.expression for o in known.outputs], "it changes an output at size zero")
    own = tuple(symbol(name) for name in added.memory)
    _ask(grown.states[kept] == known.states and grown.x[kept.stop :] == own, "it changes states")
    _ask(grown.inputs == known.inputs, "it changes inputs")


def _check_numbers(added: Added, known: System) -> None:
    """All fitted numbers are new parameters with a unit, within bounds, of a positive plausible size."""
    before = {p.name for p in known.parameters}
    new = {p.name: p for p in added.system.parameters if p.name not in before}
    fitted = [*added.amplitudes, *added.shapes]
    _ask(len({*fitted}) == len(fitted), "two numbers have one name")
    _ask({*fitted} - {*added.delays} <= {*new}, "a number is no parameter")
    for name in fitted:
        (low, high), grid = added.bounds[name], added.shapes.get(name, (0.0,))
        _ask(low <= min(grid) <= max(grid) <= high, f"{name}: its starting values are out of its bounds")
        _ask(len({*grid}) == len(grid), f"{name}: a starting value comes twice")
        _ask(0.0 < added.scales[name] < np.inf, f"{name}: its plausible size is not positive")
        parse_unit(added.units[name])
        if name in new:
            own = new[name].bounds, new[name].unit
            _ask(own == (added.bounds[name], added.units[name]), f"{name}: has other bounds or another unit")
            _ask(new[name].identify == (name not in added.shares), f"{name}: is not identified")


def _check_written(grown: System) -> None:
    """The file of a system with the effect is read as the same system, but for the order of sums."""
    with TemporaryDirectory() as folder:
        write_system(grown, Path(folder) / "grown.yaml")
        read = read_system(Path(folder) / "grown.yaml")
    _ask(list(read.signals) == list(grown.signals), "its file has other signals")
    _ask(read.parameters == grown.parameters and read.outputs == grown.outputs, "its file is another system")
    if read.dynamics != grown.dynamics:
        same = np.allclose(_rates(read), _rates(grown), rtol=ROUNDING, atol=ROUNDING)
        _ask(same, "its file has other equations")


def _rates(system: System) -> Array:
    """Rates (points, states) at random states."""
    draw = np.random.default_rng(0).uniform
    x, u = draw(-1.0, 1.0, (POINTS, len(system.states))), draw(-1.0, 1.0, (POINTS, len(system.inputs)))
    c, t = draw(0.5, 1.5, (POINTS, len(system.operating_point))), draw(0.0, 2.0, POINTS)
    function = numpy_system_function(system, list(system.dynamics), efforts_zero=True)
    with np.errstate(all="ignore"):
        return np.nan_to_num(function(t, x, u, np.empty(0), np.array(system.values), c))


def _ask(holds: bool, otherwise: str) -> None:
    if not holds:
        raise ValueError(otherwise)
