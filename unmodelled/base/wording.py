"""Names of laws and places, numbers and units in words, as answers tell them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

#: Digits and sign of an exponent, raised.
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Proper names in families of effects and their variants.
NAMES = ("Coulomb", "Stribeck", "Bouc-Wen", "Dahl", "LuGre")
#: What kinds of channels are called.
PLACES = {"actuator": "input", "sensor": "sensor", "parameter": "parameter"}


def law_name(family: str, variant: str = "") -> str:
    """Return family and variant of an effect in words; a variant may be a formula.

    Examples:
        >>> law_name("coulomb_friction", "by_direction"), law_name("hysteresis", "bouc_wen")
        ('Coulomb friction (by direction)', 'hysteresis (Bouc-Wen)')
        >>> law_name("known_terms", "x**2*v + v**3")
        'known terms (x²·v + v³)'
    """
    raised = re.sub(r"\*\*(\d+)", lambda match: match[1].translate(SUPERSCRIPTS), variant)
    text = f"{family} ({raised.replace('*', '·')})" if variant else family
    text = text.replace("_", " ")
    for name in NAMES:
        text = text.replace(name.lower().replace("-", " "), name)
    return text


def place_name(channel: str) -> str:
    """Return a channel in words.

    Examples:
        >>> place_name("actuator:u"), place_name("rail")
        ('input u', 'rail')
    """
    kind, _, name = channel.rpartition(":")
    return f"{PLACES.get(kind, kind)} {name}".strip()


def level_name(factor: str, level: float | str | None) -> str:
    """Return an entry in a column of experiments.csv in words.

    Examples:
        >>> level_name("load", 1.0), level_name("oil", "old")
        ('load is 1', 'oil is old')
    """
    return f"{factor} is {f'{level:g}' if isinstance(level, float) else level}"


def effect_names(entries: Sequence[Mapping[str, Any]]) -> str:
    """Describe several effects in words."""
    return " + ".join(map(effect_name, entries)) or "no effect"


def effect_name(entry: Mapping[str, Any]) -> str:
    """Describe an effect in words: family, variant, place and experiments.

    Examples:
        >>> effect_name({"family": "drift", "variant": "load", "port": "rail"})
        'drift (load) at rail'
        >>> about = {"port": "bed", "parameter": "G", "signal": "fan"}
        >>> effect_name({"family": "input_dependence", "variant": "parameter", **about})
        'dependence of G on fan'
        >>> effect_name({"family": "parameter_error", "port": "bed", "parameter": "G"})
        'parameter error of G'
    """
    if entry.get("signal") is not None:
        what = entry.get("parameter") or f"the load at {place_name(str(entry['port']))}"
        return f"dependence of {what} on {entry['signal']}"
    law = law_name(str(entry["family"]), str(entry.get("variant") or ""))
    place = f"of {entry['parameter']}" if entry.get("parameter") else f"at {place_name(str(entry['port']))}"
    found = f"{law} {place}"
    if entry.get("factor") is not None:
        found += f", where {level_name(entry['factor'], entry['level'])}"
    return found


def number(value: Any) -> str:
    """Format a number with four significant digits, or a whole number in full."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    size = abs(value)
    if isinstance(value, int) or 1e4 <= size < 1e7:
        text = f"{value:,.0f}".replace(",", "\u202f" if size >= 1e4 else "")
    elif size and not 1e-4 <= size < 1e7:
        mantissa, exponent = f"{value:.2e}".split("e")
        text = f"{float(mantissa):g}×10{str(int(exponent)).translate(SUPERSCRIPTS)}"
    else:
        text = f"{value:.4g}"
    return text.replace("-", "−")


#: Units that are shown with a prefix where a quantity is small, and the prefixes with their sizes.
_PREFIXED = ("m", "s", "rad", "N", "N m", "N m/s", "A", "V", "W", "J")
#: Longer units of time with their seconds, from two of which on they are used.
_LONG = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"))
_PREFIXES = ((0.1, 1.0, ""), (1e-4, 1e-3, "m"), (0.0, 1e-6, "µ"))


def clock(seconds: float) -> tuple[float, str]:
    """Return the unit in which a time of so many seconds reads best: its size in s, and its name.

    Examples:
        >>> clock(90.0), clock(480.0), clock(9000.0)
        ((1.0, 's'), (60.0, 'min'), (3600.0, 'h'))
    """
    return next(((size, unit) for size, unit in _LONG if seconds >= 2.0 * size), (1.0, "s"))


def amounts(values: Sequence[float], unit: str, digits: int = 2) -> list[str]:
    r"""Format quantities of one unit for a sentence, with the prefix that suits the largest of them.

    Number and unit stay on one line.

    Examples:
        >>> amounts([0.014, 0.0002], "m")
        ['14\xa0mm', '0.2\xa0mm']
        >>> amounts([1.804], "N", digits=3), amounts([130.0], "m^3/s")
        (['1.8\xa0N'], ['130\xa0m³/s'])
        >>> amounts([0.0125], "s"), amounts([480.0], "s"), amounts([9000.0, 1800.0], "s")
        (['12\xa0ms'], ['8\xa0min'], ['2.5\xa0h', '0.5\xa0h'])
    """
    largest = max(map(abs, values), default=0.0)
    size, prefix = 1.0, ""
    if unit == "s":
        size, unit = clock(largest)
    if unit in _PREFIXED and 1e-7 <= largest < 0.1:
        size, prefix = next((size, prefix) for least, size, prefix in _PREFIXES if largest >= least)
    shown = [f"{number(float(f'{v / size:.{digits}g}'))} {prefix}{unit_text(unit)}" for v in values]
    return [text.strip().replace(" ", "\u00a0") for text in shown]


def unit_text(unit: str | None) -> str:
    """Format a unit with raised exponents."""
    if unit in (None, "", "-", "1"):
        return ""
    return re.sub(r"\^(-?\d+)", lambda match: match[1].translate(SUPERSCRIPTS), str(unit))


def changed(value: float, given: float, unit: str) -> str:
    r"""Format a value that stands instead of another one, with as many digits as tell them apart.

    Examples:
        >>> changed(0.4, 22.918, "N m s/rad"), changed(1.0042, 1.0, "kg")
        ('0.4\xa0N\xa0m\xa0s/rad instead of 22.9', '1.004\xa0kg instead of 1')
    """
    for digits in range(3, 8):
        one, other = amounts([value, given], unit, digits)
        if one != other:
            break
    return f"{one} instead of {other.partition(chr(0xA0))[0]}"


def part_of(part: float, whole: float, unit: str) -> str:
    r"""Format a part of a whole, both with the digits that the smaller one needs.

    Examples:
        >>> part_of(3.57, 5.0, "kg"), part_of(0.018, 0.05, "kg m^2")
        ('3.6 of 5.0\xa0kg', '0.018 of 0.050\xa0kg\xa0m²')
    """
    least = min(abs(part), abs(whole)) or abs(whole)
    digits = min(max(0, 1 - math.floor(math.log10(least))), 6)
    return f"{part:.{digits}f} of {whole:.{digits}f} {unit_text(unit)}".strip().replace(
        f" {unit_text(unit)}", f" {unit_text(unit)}".replace(" ", "\u00a0")
    )


def quantity(value: Any, interval: Sequence[float] | None) -> tuple[str, str]:
    """Format a value and its interval with two significant digits of the width of the interval.

    A number that these digits would round to zero has two digits of its own, where zero is outside of the
    interval.
    """
    if interval is None:
        return number(value), ""
    low, high = interval
    large = max(abs(low), abs(high), abs(value)) if isinstance(value, int | float) else math.inf
    if not (low < high and 1e-3 <= large < 1e6):
        return number(value), f"{number(low)} to {number(high)}"
    digits = max(0, 1 - math.floor(math.log10(high - low)))
    crosses = low < 0.0 < high

    def shown(v: float) -> str:
        if v and not crosses and round(v, digits) == 0.0:
            return number(float(f"{v:.2g}"))
        return f"{v:z.{digits}f}".replace("-", "−")  # the z drops the sign of a zero

    return shown(value), f"{shown(low)} to {shown(high)}"
