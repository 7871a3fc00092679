"""Numbers of an augmented system that no machine has: what effects make of masses, frictions and gains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.remark import quantity
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis, JudgedModel
from unmodelled.diagnosis.gates.robot_numbers import LEAST_GAIN
from unmodelled.effects.library import effects
from unmodelled.effects.motion import mobility
from unmodelled.effects.place import Place
from unmodelled.systems.model import Parameter, Port, System, symbol
from unmodelled.systems.units import parse_unit

#: Samples at which laws are evaluated, evenly from all experiments, and fewest on one side of zero.
SAMPLES, FEWEST = 2000, 20
#: Share of a range that rounding may exceed.
ROUNDING = 1e-9
#: Units of what stores, resists or loses, which is never negative.
_PASSIVE = {
    parse_unit(unit).dimension
    for unit in ("kg", "kg m^2", "N s/m", "N m s", "ohm", "F", "H", "J/K", "W/K", "K/W", "J/(kg K)")
}


def impossible_numbers(diagnosis: Diagnosis) -> str:
    """Return what is impossible about the numbers of an augmented model."""
    faults = (
        *(_beyond(p) for p in diagnosis.augmented.system.parameters),
        *(_negative(diagnosis.system, p) for p in diagnosis.augmented.system.parameters),
        *_turned(diagnosis),
        *(_driving(diagnosis, port) for port in diagnosis.system.ports),
        *(_changed(diagnosis, place) for place in _places(diagnosis, "parameter")),
    )
    gains = (fault for found in diagnosis.effects for fault in _switched_off(found, diagnosis))
    return next(filter(None, (*faults, *gains)), "")


def _along(model: JudgedModel, /, *expressions: sp.Expr, **values: float) -> Array:
    """Values (expressions, samples) along the logs of a model, with other values of some parameters."""
    return model.along(expressions, SAMPLES, values).T


def _places(diagnosis: Diagnosis, kind: str) -> list[Place]:
    return list(dict.fromkeys(e.added.place for e in diagnosis.effects if e.added.place.kind == kind))


def _beyond(p: Parameter) -> str:
    """A fit keeps to its bounds, but for rounding."""
    if not np.isfinite(p.value):
        return f"{p.name} has no value"
    low, high = p.bounds or (p.value, p.value)
    near = ROUNDING * (high - low)
    if low - near <= p.value <= high + near:
        return ""
    last = f"below its lowest possible value, {low:.3g}"
    last = last if p.value < low else f"above its highest possible value, {high:.3g}"
    return f"{p.name} = {quantity(p.value, p.unit)} is {last}"


def _negative(given: System, p: Parameter) -> str:
    before = {q.name: q.value for q in given.parameters}.get(p.name, 0.0)
    if p.value >= 0.0 or before <= 0.0 or parse_unit(p.unit).dimension not in _PASSIVE:
        return ""
    return f"{p.name} would be {quantity(p.value, p.unit)}, which is never negative"


def _turned(diagnosis: Diagnosis) -> Iterator[str]:
    """Ports that an effort moves the other way than in the given system, or without any resistance."""
    # the level of a balance stands for the velocity; of a port that the search added, the file knows nothing
    moved = (replace(p, velocity=p.velocity or p.position) for p in diagnosis.known.system.ports)
    ports = [port for port in moved if port.velocity is not None]
    before, after = (
        _along(model, *(mobility(model.system, port) for port in ports))
        for model in (diagnosis.known, diagnosis.augmented)
    )
    for port, old, new in zip(ports, before, after, strict=True):
        some = (old != 0.0) & np.isfinite(old)
        with np.errstate(all="ignore"):
            ratio = old[some] / new[some]
        least = float(np.min(np.where(np.isfinite(ratio), ratio, 0.0), initial=1.0))
        if least <= 0.0:
            what = "mass or inertia" if port.domain == "power" else "capacity"
            yield f"the {what} at {port.name} would be {least:.2g} times that of the file as given"


def _driving(diagnosis: Diagnosis, port: Port) -> str:
    """Whether friction that changes would drive the machine."""
    known = {(e.family, e.variant): e for e in effects()}
    kinds = [(f, known.get((f.added.family, f.added.variant))) for f in diagnosis.effects]
    at = [(f, k) for f, k in kinds if f.added.place.name == port.name and f.added.place.kind == "port"]
    lost = [f for f, k in at if k is not None and (k.beside or getattr(k, "power", None) == "lost")]
    if port.velocity is None or not any(k is not None and k.beside for _, k in at):
        return ""
    total = sum((_contribution(f) for f in lost), sp.S.Zero)
    (power,) = _along(diagnosis.augmented, total * diagnosis.augmented.system.expression(port.velocity))
    if not np.isfinite(power).all() or power.min() < -1e-6 * np.abs(power).max():
        return f"the friction at {port.name} would drive it in a part of the logs"
    return ""


def _contribution(found: DiagnosedEffect) -> sp.Expr:
    """What an effect adds at its place."""
    pairs = zip(found.added.amplitudes, found.added.regressors, strict=True)
    return sum((symbol(name) * regressor for name, regressor in pairs), sp.S.Zero)


def _changed(diagnosis: Diagnosis, place: Place) -> str:
    """Whether a parameter that changes would be negative in a part of the logs."""
    (given,) = (p for p in diagnosis.system.parameters if p.name == place.name)
    if given.value <= 0.0 or parse_unit(given.unit).dimension not in _PASSIVE:
        return ""
    mine = (f for f in diagnosis.effects if f.added.place.name == place.name)
    mine = (f for f in mine if f.added.place.kind == "parameter")
    (acting,) = _along(diagnosis.augmented, sum(map(_contribution, mine), symbol(place.name)))
    least = float(np.min(np.where(np.isfinite(acting), acting, -np.inf)))
    if least > 0.0:
        return ""
    return f"{place.name} would fall to {quantity(least, given.unit)} in a part of the logs"


def _switched_off(found: DiagnosedEffect, diagnosis: Diagnosis) -> Iterator[str]:
    """Whether a law takes away an input or an output, with its numbers or at the ends of their intervals."""
    added = found.added
    place = added.place
    if place.kind not in ("actuator", "sensor") or added.memory or added.delays or not added.amplitudes:
        return
    raw = symbol(place.name)
    if place.kind == "sensor":
        (raw,) = (o.expression for o in diagnosis.system.outputs if o.name == place.name)
    fitted = {n: e for n, e in found.estimates.items() if n in added.amplitudes and n not in added.shares}
    ends = [
        (f"{n} = {end:.3g}, an end of its interval", {n: end})
        for n, e in fitted.items()
        for end in e.interval
    ]
    now = ", ".join(f"{n} = {e.value:.3g}" for n, e in found.estimates.items())
    for said, values in [(now, {}), *ends]:
        logged, acting = _along(diagnosis.augmented, raw, raw + _contribution(found), **values)
        if not np.isfinite(acting[np.isfinite(logged)]).all():
            yield f"with {said}, {place.name} would have no value in a part of the logs"
            return
        gain = _gain(logged, acting)
        if gain <= LEAST_GAIN * (1.0 + ROUNDING):
            yield (
                f"with {said}, {added.title} leaves {max(100.0 * gain, 0.0):.2g} % of "
                f"{place.name}, which switches it off"
            )


def _gain(raw: Array, acting: Array) -> float:
    """Smallest slope of what acts over what is logged, of positive and negative values."""
    slopes: Sequence[float] = [
        float(np.polyfit(raw[side], acting[side], 1)[0])
        for side in (raw >= 0.0, raw <= 0.0)
        if side.sum() >= FEWEST and np.ptp(raw[side]) > 1e-6 * np.abs(raw).max()
    ]
    return min(slopes, default=1.0)
