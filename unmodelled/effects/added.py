"""A system with an effect, and what fitting it needs to know."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import sympy as sp

from unmodelled.effects.columns import Column
from unmodelled.effects.place import Place
from unmodelled.systems import syntax
from unmodelled.systems.model import System, symbol


@dataclass(frozen=True)
class Added:
    """An effect at a place of a system; all amplitudes are zero, all shapes at a value of their grid.

    Attributes:
        family, variant: of the effect. place: where it acts.
        system: the system with it, whose new numbers are parameters.
        law: as a person writes it, in names of `system`.
        amplitudes: names of the parameters in which the law is linear.
        regressors: per amplitude, what one unit of it adds at the place: to an effort, an input, an output or
            a parameter. In terms of states, inputs, parameters, constants and t.
        shares: of the amplitudes, those that are 1 where the effect is there at all.
        shapes: the other new numbers that are fitted -> starting values, SI.
        bounds, scales, units: of amplitudes, shapes and delays, the bounds and a plausible size in SI.
        memory: states that the effect adds; no output shows them.
        delays: of the shapes, those that are no parameter but a delay added to an input or output.
        columns: constants that it adds to the operating point -> their values.
        per_experiment: of the amplitudes, those whose value differs from experiment to experiment.
        priors: of some amplitudes, the standard deviation around zero that is plausible without data, SI.
        linear: whether regressors times amplitudes are all that is added; else that is the tangent at zero.
        slopes: parameters of the law beyond the data, not fitted -> their values where these are positive.
        extent: name of a coordinate -> parameters that hold the ends of the range where the law was fitted.
    """

    family: str
    variant: str
    place: Place
    system: System
    law: str
    amplitudes: tuple[str, ...] = ()
    regressors: tuple[sp.Expr, ...] = ()
    shares: tuple[str, ...] = ()
    shapes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    scales: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    memory: tuple[str, ...] = ()
    delays: Mapping[str, Place] = field(default_factory=dict)
    columns: Mapping[str, Column] = field(default_factory=dict)
    per_experiment: tuple[str, ...] = ()
    priors: Mapping[str, float] = field(default_factory=dict)
    linear: bool = True
    slopes: Mapping[str, sp.Expr] = field(default_factory=dict)
    extent: Mapping[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def reported(self) -> tuple[str, ...]:
        """Names of the fitted numbers that stand in the law: no shares, and nothing that smooths a corner."""
        words = set(syntax.names(self.law))
        return tuple(name for name in (*self.amplitudes, *self.shapes) if name in words)


def with_numbers(system: System, effects: Iterable[Added], values: Mapping[str, float]) -> System:
    """`system`, to which `effects` were added, with values of parameters and of the delays among the shapes.

    A delay counts from that of the system before the effect was added. The slopes of laws beyond the data
    follow from the values.
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
