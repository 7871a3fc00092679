"""Systems that effects are added to, and plausible measurements of them."""

from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
import sympy as sp

from tests.machines.known import SYSTEMS, Array, built_in, values_of
from unmodelled import System, read_system
from unmodelled.base.arrays import Indices
from unmodelled.effects.added import Added
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales

PERIOD = 1e-3
FILES = {name: Path(__file__).with_name(f"{name}.yaml") for name in ("stage", "room", "coil", "cell", "bed")}
FILES |= {name: SYSTEMS / f"{name}.yaml" for name in ("pendulum", "slider_crank", "coupling")}
FILES["tanks"] = SYSTEMS / "cascaded_tanks" / "overflow_withheld.yaml"
FILES["volts"] = SYSTEMS / "silverbox" / "hardening_withheld.yaml"
#: Parameters of a system that effects on parameters are tried on.
FEW = 2


@cache
def system(name: str) -> System:
    return read_system(FILES[name])


class Run(NamedTuple):
    """Experiments one after the other, as sizes are measured along them."""

    offsets: Indices
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
    return Scales.measured(known, PERIOD, *run(known))


def arm() -> System:
    """The robot of systems/arm.yaml."""
    return built_in("arm")


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


def evaluated(grown: System, expressions: list[sp.Expr], p: Array) -> Array:
    """(points, k) at random points, efforts zero."""
    draw, points = np.random.default_rng(0).uniform, 40
    x = draw(-1.0, 1.0, (points, len(grown.states)))
    c = draw(0.5, 1.5, (points, len(grown.operating_point)))
    t = draw(0.0, 2.0, points)
    return values_of(grown, expressions, x, draw(-1.0, 1.0, (points, len(grown.inputs))), c, p, t=t)
