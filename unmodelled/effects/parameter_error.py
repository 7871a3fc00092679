"""Number of the file that is wrong, though the file does not mark it as uncertain."""

from unmodelled.effects.effect import ParameterEffect
from unmodelled.effects.law import Amplitude, Law, Told
from unmodelled.effects.place import Place, Site
from unmodelled.systems.model import Parameter, System
from unmodelled.systems.units import parse_unit

#: m/s^2; no machine on Earth has another gravity.
_GRAVITY = 9.75, 9.85
#: What may be missing of a number, or be there besides, in its size: it keeps its sign.
_LEAST, _MOST = -0.9999, 9999.0
#: Plausible relative error of a number that was measured, or read from a data sheet.
_PLAUSIBLE = 0.1


class ParameterError(ParameterEffect):
    """Parameter that has another value than the file says, in all experiments."""

    family = "parameter_error"

    def places(self, system: System) -> tuple[Place, ...]:
        return tuple(Place("parameter", p.name) for p in system.parameters if _may_be_wrong(p))

    def law(self, at: Site) -> Law:
        name, given = at.place.name, at["p"].low
        error, (low, high) = f"{name}_error", sorted((_LEAST * given, _MOST * given))
        amplitude = Amplitude("1", _PLAUSIBLE * abs(given), (low, high))
        told = {error: Told(symbol=name, shift=given, instead=given)}
        return Law(f"p + {error}", {error: amplitude}, told=told, phrase=f"{name} = {{{error}}}")


def _may_be_wrong(p: Parameter) -> bool:
    low, high = _GRAVITY
    gravity = low < p.value < high and parse_unit(p.unit).dimension == parse_unit("m/s^2").dimension
    return p.value != 0.0 and not (p.identify or p.per_experiment or gravity)
