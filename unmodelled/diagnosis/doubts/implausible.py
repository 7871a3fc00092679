"""Fitted numbers that make no sense as numbers of a machine."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from unmodelled.diagnosis.data.remark import Remark, listed, quantity
from unmodelled.diagnosis.doubts.efforts import Efforts
from unmodelled.diagnosis.doubts.numbers import Numbers
from unmodelled.diagnosis.fitting.hypothesis import AT_BOUND_SHARE
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.effects.added import Added
from unmodelled.systems.model import Parameter
from unmodelled.systems.units import parse_unit

#: Effort of a law, in the largest effort that acts at its port, above which it is implausible: such a
#: friction would never let the port start.
EFFORT_RATIO = 1.0
#: Change of a mass, as a share of the given one, above which it is implausible.
MASS_CHANGE = 1.0
#: Error of the gain of a sensor above which it is implausible: sensors are calibrated to a few percent.
SENSOR_GAIN_ERROR = 0.2
#: The same of an actuator: constants of motors differ by tens of percent.
ACTUATOR_GAIN_ERROR = 0.5
#: Change of parameters from which a factor that they share is told.
COMMON_FACTOR_CHANGE = 0.05
#: Difference up to which they have changed by the same factor.
COMMON_FACTOR_SPREAD = 0.02
#: Least likeness (correlation) of that factor to the scale of an input.
SCALE_LIKENESS = 0.99
#: Families whose amplitudes are efforts at a speed that the logs may hardly have.
DRY_FRICTION = ("coulomb_friction", "stribeck_friction", "hysteresis")
#: Dimensions of a mass and of a moment of inertia.
_MASSES = (parse_unit("kg").dimension, parse_unit("kg m^2").dimension)
#: Words for an effort by its dimension.
_EFFORTS = {parse_unit("N m").dimension: "torque", parse_unit("N").dimension: "force"}


def implausible(numbers: Numbers) -> tuple[Remark, ...]:
    """Return remarks on numbers of a fit that make no sense as numbers of a machine."""
    fitted = numbers.fitted
    efforts, system = Efforts(fitted), fitted.hypothesis.study.system
    uncertain = [p for p in system.parameters if p.name in system.uncertain]
    remarks = [remark for p in uncertain for remark in _known(numbers, p)]
    remarks += _common_factor(efforts)
    for added in fitted.hypothesis.effects:
        found = [r for remarks_of in (_bounds, _effort, _mass, _gain) for r in remarks_of(efforts, added)]
        remarks += found or _zero(numbers, added)
    return tuple(remarks)


def _level(numbers: Numbers) -> float:
    return numbers.fitted.hypothesis.study.options.level


def _shown(numbers: Numbers, name: str, unit: str) -> str:
    level = _level(numbers)
    low, high = numbers.interval(name, level)
    value = quantity(numbers.fitted.fit.values[name], unit)
    return f"{value} ({100.0 * level:.3g} % interval {low:.3g} to {high:.3g})"


def _known(numbers: Numbers, parameter: Parameter) -> Iterator[Remark]:
    """Remarks on an uncertain parameter of the system file."""
    fitted, name, unit, given = numbers.fitted, parameter.name, parameter.unit, parameter.value
    unknown, value = Unknown.of(parameter), fitted.fit.values[name]
    end = unknown.bound(value, AT_BOUND_SHARE)
    if end is not None:
        yield Remark((name,), "bound", _at_end(name, unit, unknown, end))
        return
    low, high = numbers.interval(name, _level(numbers))
    shown = f"{_shown(numbers, name, unit)}, {quantity(given, unit)} given"
    # bounds that are as far on both sides of zero are those of an offset, which has no sign of its own
    opposite = max(low * np.sign(given), high * np.sign(given)) < 0.0 and unknown.low != -unknown.high
    if opposite:
        yield Remark((name,), "sign", f"{name} has changed its sign: {shown}; check it in the system file")
    heavy = parse_unit(unit).dimension in _MASSES and given > 0.0
    if heavy and low > (1.0 + MASS_CHANGE) * given:
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


def _bounds(efforts: Efforts, added: Added) -> Iterator[Remark]:
    """Numbers of an effect at the limits of the values that are tried."""
    hypothesis, fit = efforts.fitted.hypothesis, efforts.fitted.fit
    mine = [u for u in hypothesis.unknowns if u.name in added.reported and not u.own]
    ends = {u: u.bound(fit.values[u.name], AT_BOUND_SHARE) for u in mine}
    each = {u.name: quantity(end, added.units[u.name]) for u, end in ends.items() if end is not None}
    if each:
        shown = listed(f"{name} = {text}" for name, text in each.items())
        what = "are limits" if len(each) > 1 else "is a limit"
        yield Remark(
            tuple(each),
            "bound",
            f"{added.title}: {shown} {what} of the tried values, so that these logs do not tell the "
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
    if not size > EFFORT_RATIO * limit:
        return
    noun = _EFFORTS.get(parse_unit(port.unit).dimension, "effort")
    part = f"{name} =" if single else f"{'an' if noun == 'effort' else 'a'} {noun} of up to"
    yield Remark(
        (name,) if single else added.amplitudes,
        "effort",
        f"{added.title}: {part} {quantity(size, port.unit)} is {size / limit:.2g} times the largest {noun} "
        f"that acts at {port.name} in these logs ({quantity(limit, port.unit)}); do not use this number, "
        "look for another effect or log slower motions",
    )


def _mass(efforts: Efforts, added: Added) -> Iterator[Remark]:
    """A wrong mass by more than the known mass."""
    if added.family != "inertia_error":
        return
    known, name = efforts.mass(added.place.name), added.amplitudes[0]
    change, unit = efforts.fitted.fit.values[name], added.units[name]
    if abs(change) > MASS_CHANGE * known:
        yield Remark(
            (name,),
            "mass",
            f"{added.title}: {name} = {quantity(change, unit)} is {abs(change) / known:.2g} times the "
            f"known one there ({quantity(known, unit)}); check the given masses, or look for another effect",
        )


def _gain(efforts: Efforts, added: Added) -> Iterator[Remark]:
    """A gain further from one than a sensor or an actuator is off."""
    most = {"sensor_gain": SENSOR_GAIN_ERROR, "actuator_gain": ACTUATOR_GAIN_ERROR}
    if added.family not in most:
        return
    (name,) = added.amplitudes
    error, part = efforts.fitted.fit.values[name], added.family.removesuffix("_gain")
    if abs(error) > most[added.family]:
        yield Remark(
            (name,),
            "gain",
            f"{added.title}: a gain of {1.0 + error:.3g} is further from one than {part}s usually are "
            f"({100.0 * most[added.family]:.0f} %); check unit and calibration of {added.place.name}, or "
            "look for another effect",
        )


def _zero(numbers: Numbers, added: Added) -> Iterator[Remark]:
    """An effect whose numbers may all be zero."""
    shared = {u.name for u in numbers.fitted.hypothesis.unknowns if not u.own}
    names = tuple(n for n in (added.amplitudes or tuple(added.delays)) if n in shared)
    ends = [numbers.interval(name, _level(numbers)) for name in names]
    if names and all(low <= 0.0 <= high for low, high in ends):
        shown = listed(f"{n} = {_shown(numbers, n, added.units[n])}" for n in names)
        yield Remark(
            names,
            "zero",
            f"{added.title}: {shown} may as well be zero; log motions in which the effect is larger",
        )


def _common_factor(efforts: Efforts) -> Iterator[Remark]:
    """Uncertain parameters at one multiple of their given values, as a wrong scale of an input does it."""
    fitted, system = efforts.fitted, efforts.fitted.hypothesis.study.system
    given = {p.name: p.value for p in system.parameters if p.name in system.uncertain and p.value}
    ratios = {n: fitted.fit.values[n] / v for n, v in given.items() if not fitted.at_bound(n)}
    off = {n: r for n, r in ratios.items() if r > 0.0 and abs(r - 1.0) > COMMON_FACTOR_CHANGE}
    for first in off.values():
        alike = tuple(n for n, r in off.items() if abs(r / first - 1.0) <= COMMON_FACTOR_SPREAD)
        name = efforts.input_like(alike, SCALE_LIKENESS) if len(alike) > 1 else None
        if name is not None:
            yield Remark(
                alike,
                "common_factor",
                f"{listed(alike)} are {first:.3g} times their given values, as if {name} were "
                f"{1.0 / first:.3g} times the logged one; check the unit and the gain of {name}",
            )
            return
