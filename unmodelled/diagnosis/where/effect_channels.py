"""Channels of effects: a port, `actuator:<input>` or `sensor:<output>`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel
from unmodelled.effects.place import Place
from unmodelled.systems.model import symbol

#: Likeness of a parameter's effect to that of an input's gain, at least [correlation].
INPUT_LIKENESS = 0.999
#: Likeness of a parameter's effect to that of a port's effort, at least [correlation].
PORT_LIKENESS = 0.99
#: Samples, at most, that the effect of a parameter is compared on.
ENOUGH_SAMPLES = 4000
_TINY = 1e-300


def channel_shares(diagnosis: Diagnosis, left: Mapping[str, float]) -> dict[str, float]:
    """Divide the squared gap of the re-identified model above the noise floor among the channels.

    The fall of the squared gap with each effect, of experiments left out, counts for the channel of the
    effect. The remaining gap of the augmented model is divided by `left`.
    """
    floor, last = diagnosis.floor**2, diagnosis.augmented.gap.value**2
    steps = [diagnosis.reidentified, *diagnosis.steps[len(diagnosis.steps) - len(diagnosis.effects) :]]
    total = {name: share * max(last - floor, 0.0) for name, share in left.items()}
    for found in diagnosis.effects:  # the largest first, which may have been found later
        before, after = steps[found.step : found.step + 2]
        name = channel_of(diagnosis.reidentified, found.added.place)
        drop = before.gap.value**2 - max(after.gap.value**2, floor)
        total[name] = total.get(name, 0.0) + max(drop, 0.0)
    whole = sum(total.values())
    if diagnosis.verdict == "no_gap" or whole <= 0.0:
        return {}
    return {name: value / whole for name, value in sorted(total.items(), key=lambda item: -item[1])}


def channel_of(model: JudgedModel, place: Place) -> str:
    """Return the channel of a place.

    A parameter acts through a channel if its change equals that of an input's gain, of an effort, or of one
    sensor: the damping of a port through that port, the constant of a motor through its input. Otherwise it
    is its own channel.
    """
    if place.kind != "parameter":
        return place.channel
    p = symbol(place.name)
    moved = [o.name for o in model.system.outputs if o.expression.has(p)]
    if not any(f.has(p) for f in model.system.closed):
        return f"sensor:{moved[0]}" if len(moved) == 1 else place.channel
    return _input_like(model, p) or _port_like(model, p) or place.channel


def _input_like(model: JudgedModel, p: sp.Symbol) -> str | None:
    """Return the channel of the input whose gain changes the dynamics like the parameter, or None."""
    system = model.system
    own = _along(model, [p * sp.diff(f, p) for f in system.closed])
    for item in system.inputs:
        u = symbol(item.name)
        other = _along(model, [u * sp.diff(f, u) for f in system.closed])
        sizes = np.sqrt(float(np.sum(own**2) * np.sum(other**2)))
        if abs(float(np.sum(own * other))) > INPUT_LIKENESS * sizes > 0.0:
            return f"actuator:{item.name}"
    return None


def _port_like(model: JudgedModel, p: sp.Symbol) -> str | None:
    """Return the port whose effort replaces the parameter; of several, the one whose motion it follows."""
    system, found = model.system, {}
    own = _along(model, [sp.diff(f, p) for f in system.closed])
    for port in system.ports:
        slopes = [sp.diff(f, symbol(port.effort)) for f in system.closed]
        other = _along(model, slopes)
        sizes = np.sqrt(np.sum(own**2, axis=1) * np.sum(other**2, axis=1))
        along = np.sum(own * other, axis=1)
        if not float(np.sum(np.abs(along))) > PORT_LIKENESS * float(np.sum(sizes)) > 0.0:
            continue
        effort = along / np.maximum(np.sum(other**2, axis=1), _TINY)
        motion = _along(model, [system.expression(name) for name in port.coordinates])
        found[port.name] = max((abs(_correlation(effort, x)) for x in motion.T), default=0.0)
    return max(found, key=lambda name: found[name]) if found else None


def _along(model: JudgedModel, expressions: list[sp.Expr]) -> Array:
    """Return the values of k expressions at some samples of the experiments, shape (samples, k)."""
    values = model.along(expressions, ENOUGH_SAMPLES, {})
    return np.where(np.isfinite(values), values, 0.0)


def _correlation(a: Array, b: Array) -> float:
    if min(np.std(a), np.std(b)) == 0.0:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])
