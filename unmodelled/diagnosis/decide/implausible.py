"""Fitted numbers that make no sense as numbers of a machine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.special import fdtri

from unmodelled.diagnosis.data.remark import Remark, listed, quantity
from unmodelled.diagnosis.decide.efforts import Efforts
from unmodelled.diagnosis.fitting.jackknife import covariance, interval
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.effects.added import Added
from unmodelled.systems.model import Parameter
from unmodelled.systems.units import parse_unit

#: Families whose amplitudes are efforts at a speed that the logs may hardly have.
DRY_FRICTION = ("coulomb_friction", "stribeck_friction", "hysteresis")
_TINY = 1e-300
#: Dimensions of a mass and of a moment of inertia.
_MASSES = (parse_unit("kg").dimension, parse_unit("kg m^2").dimension)
#: Words for an effort by its dimension.
_EFFORTS = {parse_unit("N m").dimension: "torque", parse_unit("N").dimension: "force"}


def implausible(prediction: LeftOut, alike: Sequence[LeftOut] = ()) -> tuple[Remark, ...]:
    """Return remarks on numbers of a fit that make no sense as numbers of a machine."""
    fitted = prediction.fitted
    efforts, system = Efforts(fitted), fitted.hypothesis.study.system
    uncertain = [p for p in system.parameters if p.name in system.uncertain]
    remarks = [remark for p in uncertain for remark in _known(prediction, p, alike)]
    remarks += _common_factor(efforts)
    for added in fitted.hypothesis.effects:
        found = [r for remarks_of in (_bounds, _effort, _mass, _gain) for r in remarks_of(efforts, added)]
        remarks += found or _zero(prediction, added, alike)
    return tuple(remarks)


def _level(prediction: LeftOut) -> float:
    return prediction.fitted.hypothesis.study.thresholds.level


def _shown(prediction: LeftOut, name: str, unit: str, alike: Sequence[LeftOut]) -> str:
    level = _level(prediction)
    low, high = interval(prediction, name, level, alike)
    value = quantity(prediction.fitted.fit.values[name], unit)
    return f"{value} ({100.0 * level:.3g} % interval {low:.3g} to {high:.3g})"


def _known(prediction: LeftOut, parameter: Parameter, alike: Sequence[LeftOut]) -> Iterator[Remark]:
    """Remarks on an uncertain parameter of the system file."""
    fitted, name, unit, given = prediction.fitted, parameter.name, parameter.unit, parameter.value
    unknown, value = Unknown.of(parameter), fitted.fit.values[name]
    limits = fitted.hypothesis.study.thresholds
    end = unknown.bound(value, limits.at_bound_share)
    if end is not None:
        yield Remark((name,), "bound", _at_end(name, unit, unknown, end))
        return
    low, high = interval(prediction, name, _level(prediction), alike)
    shown = f"{_shown(prediction, name, unit, alike)}, {quantity(given, unit)} given"
    # bounds that are as far on both sides of zero are those of an offset, which has no sign of its own
    opposite = max(low * np.sign(given), high * np.sign(given)) < 0.0 and unknown.low != -unknown.high
    if opposite:
        yield Remark((name,), "sign", f"{name} has changed its sign: {shown}; check it in the system file")
    heavy = parse_unit(unit).dimension in _MASSES and given > 0.0
    if heavy and low > (1.0 + limits.mass_change) * given:
        yield Remark(
            (name,),
            "mass",
            f"{name} is {value / given:.2g} times the given value: {shown}; check the given value, or look "
            "for an effect that acts like mass, such as a wrong gain of an input",
        )


def _at_end(name: str, unit: str, unknown: Unknown, end: float) -> str:
    if end == 0.0:
        return (
            f"{name} is at its bound of {quantity(0.0, unit)}: these logs show none of it, or another number "
            f"takes its place; measure {name} separately"
        )
    side, more = ("lower", "less") if end == unknown.low else ("upper", "more")
    return (
        f"{name} is at its {side} bound, {quantity(end, unit)}: these logs ask for {more}; widen its bounds "
        "in the system file if the machine allows that, else look for physics that the file leaves out"
    )


def _label(added: Added) -> str:
    return f"{added.family} at {added.place.channel}"


def _bounds(efforts: Efforts, added: Added) -> Iterator[Remark]:
    """Numbers of an effect at the limits of the values that are tried."""
    hypothesis, fit = efforts.fitted.hypothesis, efforts.fitted.fit
    mine = [u for u in hypothesis.unknowns if u.name in added.reported and not u.own]
    ends = {u: u.bound(fit.values[u.name], hypothesis.study.thresholds.at_bound_share) for u in mine}
    each = {u.name: quantity(end, added.units[u.name]) for u, end in ends.items() if end is not None}
    if each:
        shown = listed(f"{name} = {text}" for name, text in each.items())
        what = "are limits" if len(each) > 1 else "is a limit"
        yield Remark(
            tuple(each),
            "bound",
            f"{_label(added)}: {shown} {what} of the tried values, so that these logs do not tell the "
            "number; do not use it, or log motions in which it matters more",
        )


def _effort(efforts: Efforts, added: Added) -> Iterator[Remark]:
    """An effect that is stronger than all that acts at its port."""
    if added.place.kind != "port":
        return
    hypothesis, values = efforts.fitted.hypothesis, efforts.fitted.fit.values
    port = hypothesis.study.system.port(added.place.name)
    dry = added.amplitudes if added.family in DRY_FRICTION else ()
    each = {n: abs(values[n]) for n in dry if added.units[n] == port.unit}
    name = max(each, key=lambda n: each[n], default="")
    whole, limit = efforts.of(added), efforts.largest(port.name)
    single = bool(each) and each[name] >= whole
    size = each[name] if single else whole
    if not size > hypothesis.study.thresholds.effort_ratio * limit:
        return
    noun = _EFFORTS.get(parse_unit(port.unit).dimension, "effort")
    part = f"{name} =" if single else f"{'an' if noun == 'effort' else 'a'} {noun} of up to"
    yield Remark(
        (name,) if single else added.amplitudes,
        "effort",
        f"{_label(added)}: {part} {quantity(size, port.unit)} is {size / limit:.2g} times the largest {noun} "
        f"that acts at {port.name} in these logs ({quantity(limit, port.unit)}); do not use this number, "
        "look for another effect or log slower motions",
    )


def _mass(efforts: Efforts, added: Added) -> Iterator[Remark]:
    """A wrong mass by more than the known mass."""
    if added.family != "inertia_error":
        return
    known, name = efforts.mass(added.place.name), added.amplitudes[0]
    change, unit = efforts.fitted.fit.values[name], added.units[name]
    if abs(change) > efforts.fitted.hypothesis.study.thresholds.mass_change * known:
        yield Remark(
            (name,),
            "mass",
            f"{_label(added)}: {name} = {quantity(change, unit)} is {abs(change) / known:.2g} times the "
            f"known one there ({quantity(known, unit)}); check the given masses, or look for another effect",
        )


def _gain(efforts: Efforts, added: Added) -> Iterator[Remark]:
    """A gain further from one than a sensor or an actuator is off."""
    limits = efforts.fitted.hypothesis.study.thresholds
    most = {"sensor_gain": limits.sensor_gain_error, "actuator_gain": limits.actuator_gain_error}
    if added.family not in most:
        return
    (name,) = added.amplitudes
    error, part = efforts.fitted.fit.values[name], added.family.removesuffix("_gain")
    if abs(error) > most[added.family]:
        yield Remark(
            (name,),
            "gain",
            f"{_label(added)}: a gain of {1.0 + error:.3g} is further from one than {part}s usually are "
            f"({100.0 * most[added.family]:.0f} %); check unit and calibration of {added.place.name}, or "
            "look for another effect",
        )


def _zero(prediction: LeftOut, added: Added, alike: Sequence[LeftOut]) -> Iterator[Remark]:
    """An effect whose numbers may all be zero (Hotelling's test)."""
    fitted, parts = prediction.fitted, prediction.count
    shared = {u.name for u in fitted.hypothesis.unknowns if not u.own}
    names = tuple(n for n in (added.amplitudes or tuple(added.delays)) if n in shared)
    if not 0 < len(names) < parts:
        return
    spread = covariance(prediction, names)
    unit = 1.0 / np.sqrt(np.maximum(np.diag(spread), _TINY))
    z = np.array([fitted.fit.values[n] for n in names]) * unit
    square = z @ np.linalg.pinv(spread * np.outer(unit, unit), hermitian=True) @ z
    quantile = fdtri(len(names), parts - len(names), _level(prediction))
    if square < len(names) * (parts - 1) / (parts - len(names)) * quantile:
        shown = listed(f"{n} = {_shown(prediction, n, added.units[n], alike)}" for n in names)
        yield Remark(
            names,
            "zero",
            f"{_label(added)}: {shown} may as well be zero; log motions in which the effect is larger",
        )


def _common_factor(efforts: Efforts) -> Iterator[Remark]:
    """Uncertain parameters at one multiple of their given values, as a wrong scale of an input does it."""
    fitted, limits = efforts.fitted, efforts.fitted.hypothesis.study.thresholds
    system = fitted.hypothesis.study.system
    given = {p.name: p.value for p in system.parameters if p.name in system.uncertain and p.value}
    ratios = {n: fitted.fit.values[n] / v for n, v in given.items() if not fitted.at_bound(n)}
    off = {n: r for n, r in ratios.items() if r > 0.0 and abs(r - 1.0) > limits.common_factor_change}
    for first in off.values():
        alike = tuple(n for n, r in off.items() if abs(r / first - 1.0) <= limits.common_factor_spread)
        name = efforts.input_like(alike, limits.scale_likeness) if len(alike) > 1 else None
        if name is not None:
            yield Remark(
                alike,
                "common_factor",
                f"{listed(alike)} are {first:.3g} times their given values, as if {name} were "
                f"{1.0 / first:.3g} times the logged one; check the unit and the gain of {name}",
            )
            return
