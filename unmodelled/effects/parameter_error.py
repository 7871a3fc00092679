"""Number of the file that is wrong, though the file does not mark it as uncertain."""

from unmodelled.base.wording import amounts
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
        told, phrase, negative = _of_robot(at, error) or (
            Told(symbol=name, shift=given, instead=given),
            f"{name} = {{{error}}}",
            "",
        )
        amplitudes = {error: amplitude}
        return Law(f"p + {error}", amplitudes, told={error: told}, phrase=phrase, negative=negative)


def _of_robot(at: Site, error: str) -> tuple[Told, str, str] | None:
    """Words for an error of a link of a robot file, and both where it is negative; None for other numbers."""
    robot = at.system.robot
    link, quantity = ("", "") if robot is None else robot.numbers.get(at.place.name, ("", ""))
    given = amounts([at["p"].low], at.unit, 3)[0]
    if quantity == "mass":
        light = at["p"].low < 1.0
        told = Told(f"beside the {given} of the robot file", factor=1e3, unit="g") if light else Told()
        words = f"link {link} is {{{error}}} {{way}} than the {given} of the robot file"
        return told, words.replace("{way}", "heavier"), words.replace("{way}", "lighter")
    if quantity.startswith("com_"):
        told = Told(f"beside the {given} of the robot file", factor=1e3, unit="mm")
        words = f"centre of mass of link {link} is {{{error}}} further along {{way}} than in the robot file"
        axis = quantity[-1]
        return told, words.replace("{way}", axis), words.replace("{way}", f"-{axis}")
    if quantity == "inertia_scale":
        told = Told("of those of the robot file", "1 + {0}", shift=1.0)
        words = f"moments of inertia of link {link} are {{{error}}} times those of the robot file"
        return told, words, ""
    return None


def _may_be_wrong(p: Parameter) -> bool:
    low, high = _GRAVITY
    gravity = low < p.value < high and parse_unit(p.unit).dimension == parse_unit("m/s^2").dimension
    return p.value != 0.0 and not (p.identify or p.per_experiment or gravity)
