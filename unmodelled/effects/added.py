"""System with an added effect, and the numbers that a fit of the effect needs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import sympy as sp

from unmodelled.base.wording import effect_name
from unmodelled.effects.columns import Column
from unmodelled.effects.law import Told, Wave
from unmodelled.effects.place import Place
from unmodelled.systems import syntax
from unmodelled.systems.model import System, symbol

#: Family of laws that the library lacks and that a diagnosis has written down.
DISCOVERED = "discovered_law"
#: What a sensor with an error should show; the space keeps it apart from all names of systems.
RIGHT = sp.Symbol("right value", real=True)


@dataclass(frozen=True)
class Added:
    """Effect at a place of a system, with all amplitudes zero and all shapes at a value of their grids."""

    family: str
    variant: str  # empty for the plain form of the family
    place: Place
    system: System  # with the effect, whose new numbers are parameters
    law: str  # as a person writes it, in names of `system`
    amplitudes: tuple[str, ...] = ()  # parameters in which the law is linear
    regressors: tuple[sp.Expr, ...] = ()  # contribution of one unit of each amplitude at the place
    shares: tuple[str, ...] = ()  # amplitudes that switch the effect: 1 if it is present, 0 if not
    #: Starting values of the other fitted numbers, in SI units.
    shapes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    #: Of amplitudes, shapes and delays, in SI units.
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    scales: Mapping[str, float] = field(default_factory=dict)  # plausible magnitudes of the same, in SI units
    units: Mapping[str, str] = field(default_factory=dict)  # SI units of the same
    memory: tuple[str, ...] = ()  # states that the effect adds; no output shows them
    #: Places of the shapes that are delays instead of parameters.
    delays: Mapping[str, Place] = field(default_factory=dict)
    columns: Mapping[str, Column] = field(default_factory=dict)  # new constants of the operating point
    per_experiment: tuple[str, ...] = ()  # amplitudes that differ between experiments
    #: Plausible deviations from zero of amplitudes, in SI units.
    priors: Mapping[str, float] = field(default_factory=dict)
    usual: bool = False  # whether it is a part of the measurement chain, which every log has
    linear: bool = True  # else regressors times amplitudes are only the tangent of the contribution at zero
    #: Of the law beyond the data, used where positive.
    slopes: Mapping[str, sp.Expr] = field(default_factory=dict)
    #: Parameters of the edges of the data, by coordinate.
    extent: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    robot: Mapping[str, str] = field(default_factory=dict)  # as in `Law`, as are `told` and `phrase`
    told: Mapping[str, Told] = field(default_factory=dict)
    waves: Mapping[str, Wave] = field(default_factory=dict)  # as in `Law`, in names of `system`
    phrase: str = ""
    negative: str = ""
    cycle: float | None = None  # as in `Law`
    error: sp.Expr = sp.S.Zero  # of a sensor with a `cycle`, over `RIGHT`
    signals: Mapping[str, str] = field(default_factory=dict)  # signal whose unit a number has

    @property
    def key(self) -> tuple[str, str, Place]:
        """Return family, variant and place."""
        return self.family, self.variant, self.place

    @property
    def site(self) -> tuple[str, str]:
        """Return family and channel; variants of a law at one channel are one explanation."""
        return self.family, self.place.channel

    @property
    def title(self) -> str:
        """Return law, place and level in words, such as "Coulomb friction at joint, where oil is old"."""
        place = self.place
        about = {"family": self.family, "variant": self.variant, "port": place.channel}
        where = {"factor": place.factor, "level": place.level, "signal": place.signal}
        return effect_name({**about, **where, "parameter": place.name if place.kind == "parameter" else None})

    @property
    def is_other_value(self) -> bool:
        """Whether it says no more than that a parameter has another value in all experiments."""
        everywhere = self.place.kind == "parameter" and self.place.factor is None
        return everywhere and self.regressors == (sp.S.One,) and not self.per_experiment

    @property
    def reported(self) -> tuple[str, ...]:
        """Names of the fitted numbers in the law, but for switches and numbers that only smooth a corner."""
        words = set(syntax.names(self.law))
        return tuple(name for name in (*self.amplitudes, *self.shapes) if name in words)


def with_numbers(system: System, effects: Iterable[Added], values: Mapping[str, float]) -> System:
    """Return a system whose effects have given values of their parameters and delays, in SI units.

    Slopes of laws beyond the data follow from the values.
    """
    system = system.with_values(values)
    known = {symbol(p.name): sp.Float(p.value) for p in system.parameters}
    for effect in effects:
        slopes = {name: float(slope.xreplace(known)) for name, slope in effect.slopes.items()}
        system = system.with_values({name: max(slope, 0.0) for name, slope in slopes.items()})
        for name, place in effect.delays.items():
            system = _delayed(system, place, values.get(name, 0.0), effect.system)
    return system


def _delayed(system: System, place: Place, delay: float, before: System) -> System:
    if place.kind == "actuator":
        known = {i.name: i.delay for i in before.inputs}
        inputs = (
            replace(i, delay=known[i.name] + delay) if i.name == place.name else i for i in system.inputs
        )
        return replace(system, inputs=tuple(inputs))
    known = {o.name: o.delay for o in before.outputs}
    outputs = (replace(o, delay=known[o.name] + delay) if o.name == place.name else o for o in system.outputs)
    return replace(system, outputs=tuple(outputs))
