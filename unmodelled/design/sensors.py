"""The further sensor that would help a designed experiment most to tell models apart."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from unmodelled.design.criterion import Criterion, distance, weighted
from unmodelled.systems.model import System, symbol
from unmodelled.systems.units import describe, parse_unit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensor:
    """A sensor that a machine does not have yet."""

    label: str  # such as "v" or "the effort f at rail"
    unit: str  # SI
    of: Callable[[System], sp.Expr]  # the sensed quantity of a model


@dataclass(frozen=True, eq=False)
class BestSensor:
    """The sensor that separates the alternatives best in an experiment."""

    sensor: Sensor
    accuracy: float  # assumed error, as a share of the quantity's standard deviation in the experiment
    distances: Array  # (alternatives,) with this sensor, standard deviations


def sensors(system: System) -> Iterator[Sensor]:
    """Yield the states, their rates and the efforts of ports that no output shows."""
    outputs = {output.expression for output in system.outputs}
    for state, x, rate in zip(system.states, system.x, system.dynamics, strict=True):
        if x not in outputs:
            yield Sensor(state.name, state.unit, partial(_state, state.name))
        if rate not in {*system.x, *outputs}:
            unit = describe(parse_unit(f"({state.unit})/s").dimension)
            yield Sensor(f"d({state.name})/dt", unit, partial(_rate, state.name))
    for port in system.ports:
        yield Sensor(f"the effort {port.effort} at {port.name}", port.unit, partial(_effort, port.name))


def _state(name: str, system: System) -> sp.Expr:
    return symbol(name)


def _rate(name: str, system: System) -> sp.Expr:
    rate = system.closed[[state.name for state in system.states].index(name)]
    return rate.xreplace(dict.fromkeys(system.e, sp.S.Zero))


def _effort(name: str, system: System) -> sp.Expr:
    law = system.port(name).law
    return sp.S.Zero if law is None else law


def best_sensor(criterion: Criterion, system: System, u: Array) -> BestSensor | None:
    """Return the sensor with which an experiment u (samples, inputs), SI, separates the alternatives best.

    Noise of the sensor and error of the named model in its quantity are assumed to be the same shares of the
    quantity's standard deviation in the experiment as those of the present outputs (medians).
    """
    known = list(sensors(system))
    if len(criterion.rivals) < 2 or not known:
        return None
    models = [rival.sets[0][0] for rival in criterion.rivals]
    runs = [
        rival.runs(u[None], criterion.limits, True, [sensor.of(model) for sensor in known])
        for rival, model in zip(criterion.rivals, models, strict=True)
    ]
    size = runs[0][0][0, 0].std(axis=0)
    seen = size > 0.0
    if not seen.any():
        return None
    noise, spread = (float(np.median(e[seen] / size[seen])) for e in (criterion.noise, criterion.spread))
    share = np.hypot(noise, np.sqrt(criterion.limits.samples) * spread)
    found = []
    for k, sensor in enumerate(known):
        unit = share * max(float(w[0, 0, :, k].std()) for _, w in runs)
        if not 0.0 < unit < np.inf:
            continue
        named, *others = (
            weighted(rival, np.concatenate([y / criterion.unit, w[..., k : k + 1] / unit], axis=-1))
            for rival, (y, w) in zip(criterion.rivals, runs, strict=True)
        )
        distances = np.array([distance(named, other)[0] for other in others])
        found.append(BestSensor(sensor, float(np.hypot(noise, spread)), distances))
    return max(found, key=lambda one: float(one.distances.min()), default=None)
