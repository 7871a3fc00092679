"""Draw cases: single effects, pairs, effects in part of the runs, effects of no family, and none."""

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations

import numpy as np

from pipeline.rigs.withheld.cases import GROUP, Case, Planted
from pipeline.rigs.withheld.effects.effect import Plantable
from pipeline.rigs.withheld.machine import Machine
from pipeline.rigs.withheld.machines import MACHINES
from unmodelled.base.errors import BadInput

#: Families of effects that a diagnosis can name and a machine plants; a test compares them with the library.
FAMILIES = frozenset(
    (
        *("viscous_friction", "coulomb_friction", "stribeck_friction", "load_friction", "quadratic_drag"),
        *("position_dependent_friction", "hysteresis", "linear_spring", "nonlinear_spring", "end_stop"),
        *("constant_load", "gravity_load", "torque_ripple", "backlash", "flexible_transmission"),
        *("inertia_error", "actuator_gain", "actuator_offset", "actuator_saturation", "actuator_dead_zone"),
        *("actuator_asymmetry", "actuator_lag", "actuator_rate_limit", "input_delay", "sensor_gain"),
        *("sensor_offset", "sensor_delay", "sensor_lag", "drift", "scatter", "root_outflow", "linear_loss"),
        *("overflow", "storage", "radiation", "inductance_saturation", "self_heating", "rc_branch"),
    )
)
LEVELS = 0.3, 3.0  # of a drawn case, in typical sizes
_PAIRS, _NULLS = 12, 8  # per machine

Effects = tuple[Planted, ...]


def cases(
    kind: str, seed: int, level: float | None = None, machines: Sequence[Machine] = MACHINES
) -> list[Case]:
    """Draw cases of a kind on all machines, in random order, so that the first cases are a fair sample."""
    kinds: dict[str, Callable[[Machine, np.random.Generator], Iterator[Effects]]] = {
        "single": _singles,
        "pair": _pairs,
        "null": _nulls,
        "outside": _outside,
        "local": _locals,
    }
    if kind not in kinds:
        raise BadInput(f"kind: {kind!r} is not one of {', '.join(kinds)}")
    rng = np.random.default_rng([seed, sum(map(ord, kind))])
    drawn = [(machine.name, effects) for machine in machines for effects in kinds[kind](machine, rng)]
    found = []
    for k in rng.permutation(len(drawn)).tolist():
        size = float(np.exp(rng.uniform(*np.log(LEVELS)))) if level is None else level
        system, effects = drawn[k]
        found.append(Case(system, effects, round(size, 3), int(rng.integers(2**31))))
    return found


def named(one: Plantable) -> Planted:
    """Return the planted effect that a machine's entry offers."""
    return Planted(one.family, one.channel)


def of_families(machine: Machine) -> list[Plantable]:
    """Return the effects of a machine that belong to a family."""
    return [one for one in machine.plantable if one.family in FAMILIES]


def _singles(machine: Machine, rng: np.random.Generator) -> Iterator[Effects]:
    for one in of_families(machine):
        yield (named(one),)


def _pairs(machine: Machine, rng: np.random.Generator) -> Iterator[Effects]:
    """Two effects of different families that are not alike."""
    every = [
        (one, other)
        for one, other in combinations(of_families(machine), 2)
        if one.family != other.family and (other.family, other.channel) not in one.alike
    ]
    for k in rng.choice(len(every), _PAIRS, replace=False).tolist():
        yield tuple(named(one) for one in every[k])


def _nulls(machine: Machine, rng: np.random.Generator) -> Iterator[Effects]:
    for _ in range(_NULLS):
        yield ()


def _outside(machine: Machine, rng: np.random.Generator) -> Iterator[Effects]:
    for one in machine.plantable:
        if one.family not in FAMILIES:
            yield (named(one),)


def _locals(machine: Machine, rng: np.random.Generator) -> Iterator[Effects]:
    choices: list[tuple[str, float | str]] = [
        (factor, at) for factor, levels in machine.factors.items() for at in levels
    ]
    choices += [(GROUP, group) for group in machine.groups]
    for one in machine.plantable:
        if one.local:
            yield (Planted(one.family, one.channel, *choices[int(rng.integers(len(choices)))]),)
