"""System with an added effect, and the numbers that a fit of the effect needs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import sympy as sp

from unmodelled.effects.columns import Column
from unmodelled.effects.law import Told
from unmodelled.effects.place import Place
from unmodelled.systems import syntax
from unmodelled.systems.model import System, symbol

#: Family of laws that the library lacks and that a diagnosis has written down.
DISCOVERED = "discovered_law"


@dataclass(frozen=True)
class Added:
    """Effect at a place of a system, with all amplitudes zero and all shapes at a value of their grids.

    Attributes:
        family: name of the family, such as "coulomb_friction".
        variant: name of the variant; empty for the plain form of the family.
        place: place where the effect acts.
        system: system with the effect; its new numbers are parameters.
        law: law as a person writes it, in names of `system`.
        amplitudes: names of the parameters in which the law is linear; default none.
        regressors: contribution of one unit of each amplitude to the effort, input, output or parameter at
            the place, in terms of states, inputs, parameters, constants and t; default none.
        shares: names of the amplitudes that switch the effect: 1 if it is present, 0 if not; default none.
        shapes: starting values of the other fitted numbers by name, in SI units; default none.
        bounds: lowest and highest value of amplitudes, shapes and delays by name, in SI units.
        scales: plausible magnitude of amplitudes, shapes and delays by name, in SI units.
        units: SI unit of amplitudes, shapes and delays by name.
        memory: names of the states that the effect adds; no output shows them; default none.
        delays: place of each shape that is a delay of an input or output instead of a parameter; default
            none.
        columns: constants that the effect adds to the operating point by name, with their values; default
            none.
        per_experiment: names of the amplitudes that differ between experiments; default none.
        priors: plausible standard deviation around zero of some amplitudes, in SI units; default none.
        linear: whether regressors times amplitudes are the whole contribution; otherwise they are its tangent
            at zero.
        slopes: slopes of the law beyond the data by parameter name, used where they are positive; default
            none.
        extent: names of the two parameters that hold the edges of the data, by name of the coordinate;
            default none.
        robot: new values of numbers of a robot file that hold the law, as in `Law`, in names of `system`;
            default none.
        told: words of the trade instead of numbers of the law, as in `Law`, in names of `system`; default
            none.
        phrase: the effect in a few words, as in `Law`, in names of `system`; default "".
        signals: name of the signal whose unit a number has, by name of the number; default none.
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
    robot: Mapping[str, str] = field(default_factory=dict)
    told: Mapping[str, Told] = field(default_factory=dict)
    phrase: str = ""
    signals: Mapping[str, str] = field(default_factory=dict)

    @property
    def key(self) -> tuple[str, str, Place]:
        """Return family, variant and place."""
        return self.family, self.variant, self.place

    @property
    def site(self) -> tuple[str, str]:
        """Return family and channel; variants of a law at one channel are one explanation."""
        return self.family, self.place.channel

    @property
    def is_other_value(self) -> bool:
        """Whether it says no more than that a parameter has another value in all experiments."""
        everywhere = self.place.kind == "parameter" and self.place.factor is None
        return everywhere and self.regressors == (sp.S.One,) and not self.per_experiment

    @property
    def reported(self) -> tuple[str, ...]:
        """Names of the fitted numbers in the law, without switches and without numbers that only smooth a
        corner.
        """
        words = set(syntax.names(self.law))
        return tuple(name for name in (*self.amplitudes, *self.shapes) if name in words)


def with_numbers(system: System, effects: Iterable[Added], values: Mapping[str, float]) -> System:
    """Return a system whose effects have given values of their parameters and delays.

    Slopes of laws beyond the data follow from the values.

    Examples:
        >>> from pathlib import Path
        >>> from unmodelled.effects.input_delay import InputDelay
        >>> from unmodelled.effects.place import Place
        >>> from unmodelled.effects.scales import Scales
        >>> from unmodelled.systems.reader import read_system
        >>> pendulum = read_system(Path("systems/pendulum.yaml"))
        >>> sizes = Scales({}, {}, {}, {}, period=0.001, duration=2.0)
        >>> late = InputDelay().add(pendulum, Place("actuator", "torque"), sizes)
        >>> with_numbers(late.system, [late], {"T_d_torque": 0.004}).inputs[0].delay
        0.004
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
