"""Numbers that rest on a guess of the system file: known only in proportion to it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.remark import listed, quantity
from unmodelled.diagnosis.data.result import Diagnosis
from unmodelled.effects.scales import ENOUGH
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import Parameter, System
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.units import describe, parse_unit, power, times

#: Step of the logarithm of a number, difference by rounding that is left of it, and largest denominator of an
#: exponent.
_STEP, _ROUNDING, _FRACTION = 1e-4, 1e-6, 4


@dataclass(frozen=True)
class Over:
    """A number over powers of guesses, which logs know where they do not know the number."""

    symbol: str  # with a place for that of the number, such as "{}/k"
    unit: str  # SI
    divisor: float  # of the value, SI
    given: tuple[str, ...]  # the guesses with their values

    @property
    def missing(self) -> str:
        """Return what must be known first for the number itself."""
        return listed(each.partition(" = ")[0] for each in self.given)


def over_guesses(found: Diagnosis) -> dict[str, Over]:
    """Return what is known of fitted numbers that are in proportion to guesses, by their names."""
    return _over(_told(found), {p.name: p for p in found.augmented.system.parameters})


def resting_on_guesses(found: Diagnosis) -> Iterator[str]:
    """Yield a note on every guessed number that the fits hold: what follows without it, and what does not."""
    known, fitted = {p.name: p for p in found.augmented.system.parameters}, _fitted(found)
    for guess, exponents in _told(found):
        told = f"{guess.name} = {quantity(guess.value, guess.unit)} is a guess of the system file"
        if exponents is None:
            yield f"{told}, and was held: mark it identify: true to fit it, or measure it"
            continue
        ratios = [
            f"{over.symbol.format(name)} = {quantity(fitted[name] / over.divisor, over.unit)}"
            for name, over in _over([(guess, exponents)], known).items()
        ]
        if ratios:
            yield (
                f"{told} that these logs cannot check. Known without it: {listed(ratios)}; "
                f"the numbers themselves only once {guess.name} is measured"
            )


def _fitted(found: Diagnosis) -> dict[str, float]:
    """The fitted numbers, of effects first."""
    known = {p.name for p in found.augmented.system.parameters}
    effects = {n: e.value for effect in found.effects for n, e in effect.estimates.items() if n in known}
    return {**effects, **{n: e.value for n, e in found.parameters.items()}}


def _told(found: Diagnosis) -> list[tuple[Parameter, Mapping[str, Fraction] | None]]:
    """The guesses that the fits hold, with the exponents of fitted numbers that are in proportion to them."""
    system, names = found.augmented.system, list(_fitted(found))
    guesses = [p for p in system.parameters if p.guess and not p.identify]
    return [(guess, proportions(system, found.augmented.logs, guess, names)) for guess in guesses]


def _over(
    told: Iterable[tuple[Parameter, Mapping[str, Fraction] | None]], known: Mapping[str, Parameter]
) -> dict[str, Over]:
    over: dict[str, Over] = {}
    for guess, exponents in told:
        for name, exponent in (exponents or {}).items():
            if exponent:
                before = over.get(name, Over("{}", known[name].unit, 1.0, ()))
                own, other = (parse_unit(unit).dimension for unit in (before.unit, guess.unit))
                raised = guess.name if abs(exponent) == 1 else f"{guess.name}^({abs(exponent)})"
                symbol = f"{before.symbol}{'/' if exponent > 0 else '*'}{raised}"
                unit = describe(times(own, power(other, -exponent)))
                given = (*before.given, f"{guess.name} = {quantity(guess.value, guess.unit)}")
                over[name] = Over(symbol, unit, before.divisor * guess.value ** float(exponent), given)
    return over


def proportions(
    system: System, logs: Logs, guess: Parameter, names: Sequence[str]
) -> Mapping[str, Fraction] | None:
    """Return exponents of a guess with which other parameters change so that outputs stay the same.

    None if there are no such exponents: then a fit of the guess to the logs may tell its value.
    """
    moved = _influence(system, logs, [guess.name, *names])
    size = np.linalg.norm(moved, axis=1, keepdims=True)
    size[size == 0.0] = 1.0
    wanted = moved[0] / size[0]
    found, *_ = np.linalg.lstsq((moved[1:] / size[1:]).T, -wanted, rcond=_ROUNDING)
    left = np.linalg.norm(wanted + found @ (moved[1:] / size[1:]))
    if left > _ROUNDING**0.5 or not wanted.any():
        return None
    exact = found * size[0] / size[1:, 0]
    return {n: Fraction(float(e)).limit_denominator(_FRACTION) for n, e in zip(names, exact, strict=True)}


def _influence(system: System, logs: Logs, names: Sequence[str]) -> Array:
    """Changes of rates and outputs at samples of the logs with the logarithms of parameters, (names, ...).

    Every rate and every output counts in its own size.
    """
    rows = np.arange(0, len(logs.t), -(-len(logs.t) // ENOUGH))
    expressions = [*system.closed, *(output.expression for output in system.outputs)]
    function = numpy_system_function(system, expressions, efforts_zero=True)
    place = [p.name for p in system.parameters]
    data = logs.t[rows], logs.x[rows], logs.u[rows], np.empty(0)

    def at(name: str, step: float) -> Array:
        values = np.array(system.values)
        values[place.index(name)] *= np.exp(step)
        return function(*data, values, logs.c[logs.owner[rows]])

    moved = np.array([(at(n, _STEP) - at(n, -_STEP)) / (2.0 * _STEP) for n in names])
    moved = np.nan_to_num(moved, posinf=0.0, neginf=0.0)
    scale = np.abs(moved).max(axis=(0, 1))
    return np.asarray((moved / np.where(scale > 0.0, scale, 1.0)).reshape(len(names), -1))
