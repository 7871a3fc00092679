"""Systems that effects are added to, and plausible measurements of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from unmodelled.effects.added import Added
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.reader import read_system

Array = NDArray[np.float64]
PERIOD = 1e-3
SYSTEMS = Path(__file__).parents[3] / "systems"
FILES = {
    "stage": Path(__file__).with_name("stage.yaml"),
    "pendulum": SYSTEMS / "pendulum.yaml",
    "slider_crank": SYSTEMS / "slider_crank.yaml",
    "tanks": SYSTEMS / "cascaded_tanks" / "overflow_withheld.yaml",
    "volts": SYSTEMS / "silverbox" / "hardening_withheld.yaml",
    "room": Path(__file__).with_name("room.yaml"),
    "coil": Path(__file__).with_name("coil.yaml"),
    "cell": Path(__file__).with_name("cell.yaml"),
    "bed": Path(__file__).with_name("bed.yaml"),
    "coupling": SYSTEMS / "coupling.yaml",
}
#: Parameters of a system that effects on parameters are tried on.
FEW = 2


@cache
def system(name: str) -> System:
    return read_system(FILES[name])


@dataclass(frozen=True)
class Run:
    """Experiments one after the other."""

    offsets: NDArray[np.int64]
    t: Array
    x: Array
    u: Array
    c: Array


def run(system: System, n: int = 2000) -> Run:
    """One experiment whose states swing, their derivatives consistent where one is the other's.

    A second body moves half as far, so that the bodies move against each other.
    """
    t = PERIOD * np.arange(n)
    swing = np.array([0.3 * np.sin(7.0 * t + 0.4), 2.1 * np.cos(7.0 * t + 0.4)])
    u = np.tile(np.sin(11.0 * t), (len(system.inputs), 1)).T
    x = np.resize(swing, (len(system.states), n)).T * 0.5 ** (np.arange(len(system.states)) // 2)
    return Run(np.array([0, n]), t, x, u, np.full((1, len(system.operating_point)), 1.2))


def measured(known: System) -> Scales:
    """Sizes along `run`."""
    given = run(known)
    return Scales.measured(known, PERIOD, given.offsets, given.t, given.x, given.u, given.c)


@cache
def arm() -> System:
    """The robot of systems/arm.yaml."""
    return read_system(SYSTEMS / "arm.yaml")


@cache
def arm_scales() -> Scales:
    """Sizes along a run of the robot."""
    return measured(arm())


@cache
def scales(name: str) -> Scales:
    return measured(system(name))


@dataclass(frozen=True)
class Case:
    """An effect at a place of a system."""

    name: str
    effect: Effect
    place: Place

    @property
    def system(self) -> System:
        return system(self.name)

    @property
    def added(self) -> Added:
        return _added(self)

    @property
    def linear(self) -> bool:
        return self.added.linear and bool(self.added.amplitudes)

    def __str__(self) -> str:
        effect = self.effect
        return "-".join(filter(None, (self.name, effect.family, effect.variant, self.place.name)))


@cache
def _added(case: Case) -> Added:
    return case.effect.add(case.system, case.place, scales(case.name))


@cache
def cases(*names: str) -> tuple[Case, ...]:
    """Every effect at every place of the systems `names` (of all unless given)."""
    return tuple(
        Case(name, effect, place)
        for name in names or FILES
        for effect in effects()
        for place in islice(effect.places(system(name)), FEW)
    )


def at_place(added: Added) -> sp.Expr:
    """What acts at the place: a law, an input or a parameter as it acts, or what an output shows."""
    grown, place = added.system, added.place
    if place.kind == "port":
        return grown.port(place.name).law
    if place.kind == "sensor":
        return next(o.expression for o in grown.outputs if o.name == place.name)
    return grown.signals[f"{place.name}_acting"]


def values(of: Added, **numbers: float) -> Array:
    """(parameters,) of its system, some of them other numbers."""
    return np.array([numbers.get(p.name, p.value) for p in of.system.parameters])


def somewhere(grown: System, count: int = 40, seed: int = 0) -> tuple[Array, Array, Array, Array]:
    """t, x, u and c at random."""
    draw = np.random.default_rng(seed).uniform
    x = draw(-1.0, 1.0, (count, len(grown.states)))
    c = draw(0.5, 1.5, (count, len(grown.operating_point)))
    return draw(0.0, 2.0, count), x, draw(-1.0, 1.0, (count, len(grown.inputs))), c


def evaluated(grown: System, expressions: list[sp.Expr], p: Array, seed: int = 0) -> Array:
    """(count, k) at random points, efforts zero."""
    t, x, u, c = somewhere(grown, seed=seed)
    function = numpy_system_function(grown, expressions, efforts_zero=True)
    return function(t, x, u, np.empty(0), p, c)
