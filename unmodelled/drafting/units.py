"""Units in the names of columns and in files, as people write them."""

from __future__ import annotations

import re

from unmodelled.systems.units import ONE, Dimension, parse_logged


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


#: Units that end a name, written exactly so: `mW` is no `MW`, and a small `w` is no watt.
_EXACT = _set(
    "rad deg mrad m mm cm um µm km rpm ms us ns N kN mN Nm A mA kA V mV kV W kW mW MW K degC degF Pa kPa "
    "MPa hPa bar mbar psi Ah mAh kg Hz % ° °C"
)
#: Units that end a name in small letters, or in other words than the unit.
_SPELLED = {
    **{word: word for word in _set("rad deg mrad mm cm um rpm ms us ns bar mbar psi kg")},
    **{"degree": "deg", "degrees": "deg", "grad": "deg", "nm": "N m", "n": "N", "kn": "kN", "a": "A"},
    **{"ma": "mA", "amp": "A", "amps": "A", "v": "V", "mv": "mV", "kv": "kV", "volt": "V", "volts": "V"},
    **{"w": "W", "kw": "kW", "watt": "W", "watts": "W", "ah": "Ah", "mah": "mAh", "pa": "Pa", "kpa": "kPa"},
    **{"mpa": "MPa", "hpa": "hPa", "degc": "degC", "celsius": "degC", "kelvin": "K", "pct": "%"},
    **{"percent": "%", "prozent": "%", "lpm": "l/min", "gpm": "gallon/min", "dps": "deg/s"},
    **dict.fromkeys(_set("rev revs turn turns umdrehungen"), "turn"),
    **dict.fromkeys(
        _set("inc incs increment increments inkremente count counts cnt cnts tick ticks lsb"), "count"
    ),
    **dict.fromkeys(_set("u/min rev/min r/min upm"), "rpm"),
}
#: Signs of degrees that are one character.
_SIGNS = str.maketrans({"\u2103": "degC", "\u2109": "degF"})
#: Units that a name gives in two words: `vel_rad_s`, `flow_l_min`, `q_m3_per_h`.
_ABOVE = _set("rad deg turn m mm cm l L ml m3 kg A V")
_BELOW = {"s": "s", "sec": "s", "min": "min", "h": "h"}
#: Units of temperatures whose letters mean other things in names.
_DEGREES = {"C": "degC", "c": "degC", "F": "degF", "f": "degF", "K": "K", "k": "K"}
#: A number before a unit or behind it: `0.1 deg`, `1/10 °C`, `x10 mV`, `deg/10`.
_BEFORE = re.compile(r"^(?:[x*]\s*)?(1\s*/\s*)?(\d+(?:[.,]\d+)?(?:[eE]-?\d+)?)\s*[*x·]?\s*(?=[^\W\d_]|[°%µ])")
_BEHIND = re.compile(r"(?<=\w)\s*([/x*])\s*(\d+(?:[.,]\d+)?)$")
_WORD = re.compile(r"(?:[^\W\d_]|[%°µ])+(?:3(?=[\W_]))?")
_BRACKET = re.compile(r"[\[(]([^\[\]()]*[^\W\d_%°][^\[\]()]*|\s*[%°]\s*)[\])]\s*$")


def known_unit(text: str | None) -> str | None:
    """Return a unit as this package writes it, without a number beside it; None for another text."""
    return None if text is None else _as_unit(text) or _as_unit(_apart_from_number(text)[1])


def factor_of(name: str, given: str | None) -> float:
    """Return the number beside the unit of a column, by which its values are in this unit; 1 without one.

    Examples:
        >>> [factor_of(name, None) for name in ("pos (0.1 deg)", "T [1/10 °C]", "n [1/min]", "u [mV*10]")]
        [0.1, 0.1, 1.0, 10.0]
    """
    found = _BRACKET.search(name.translate(_SIGNS))
    texts = [text for text in (given, found[1] if found else None) if known_unit(text)]
    return _apart_from_number(texts[0])[0] if texts and _as_unit(texts[0] or "") is None else 1.0


def _apart_from_number(text: str | None) -> tuple[float, str]:
    """A number beside a unit, 1 without one, and the text without it."""
    text = (text or "").strip()
    before, behind = _BEFORE.match(text), _BEHIND.search(text)
    number = before[2] if before else behind[2] if behind else "1"
    value = float(number.replace(",", ".")) or 1.0
    if before:
        return (1.0 / value if before[1] else value), text[before.end() :]
    return (1.0 / value if behind and behind[1] == "/" else value), text[: behind.start()] if behind else text


def _as_unit(text: str) -> str | None:
    if not text.strip():
        return None
    text = text.strip().translate(_SIGNS)
    spelled = text if text in _EXACT else _SPELLED.get(text.lower(), text)
    spelled = re.sub(r"\b(m|cm|mm)([23])\b", r"\1^\2", spelled)
    try:
        parse_logged(spelled)
    except ValueError:
        return None
    return spelled


def bracketed(name: str) -> str | None:
    """Return the unit in brackets at the end of a name; None if there is none, as in `q[3]`."""
    found = _BRACKET.search(name.translate(_SIGNS))
    return known_unit(found[1]) if found else None


def ending(name: str) -> tuple[str, bool] | None:
    """Return the unit that the last word of a name may be, and whether it is a letter; None if it is none."""
    words = [word for word in _WORD.findall(name) if word not in ("per", "pro")]
    if len(words) > 2 and words[-2] in _ABOVE and words[-1] in _BELOW:
        return f"{words[-2].replace('3', '^3')}/{_BELOW[words[-1]]}", False
    words = [*words[:-1], *_apart(words[-1])] if words else []
    last = words[-1] if words else ""
    unit = known_unit(last) if last in _EXACT else _SPELLED.get(last.lower())
    if unit is None or (len(words) < 2 and unit != "count" and (last not in _EXACT or last == "m")):
        return None
    return unit, len(last) == 1 and last.isalpha()


def _apart(word: str) -> list[str]:
    """A word without its unit, and the unit: `currentmA`, `speedRPM`."""
    if word in _EXACT:
        return [word]
    for unit in sorted(_EXACT, key=len, reverse=True):
        if unit != unit.lower() and len(unit) > 1 and re.search(rf"[a-z]{unit}$", word):
            return [word.removesuffix(unit), unit]
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", word).split()


def in_degrees(name: str, given: str | None) -> str | None:
    """Return the degrees that a lonely C or F is as the unit of a column; None for another unit."""
    found = _BRACKET.search(name)
    text = (given or (found[1] if found else "")).strip()
    return {"C": "degC", "F": "degF"}.get(text)


def of_temperature(name: str) -> str | None:
    """Return the unit that the last letter of the name of a temperature is; None if it is none."""
    words = _WORD.findall(name)
    return _DEGREES.get(words[-1]) if len(words) > 1 else None


def dimension_of(unit: str) -> Dimension:
    """Return the dimension of a known unit."""
    return parse_logged(unit)[0].dimension


def si_unit(unit: str) -> str:
    """Return the SI unit of a known unit, as it is written."""
    return parse_logged(unit)[0].text or "1"


def is_angle(unit: str) -> bool:
    """Return whether a unit without a dimension is that of an angle."""
    return dimension_of(unit) == ONE and si_unit(unit) == "rad"


def is_position(unit: str) -> bool:
    """Return whether a unit is that of an angle or a length."""
    return is_angle(unit) or dimension_of(unit) == dimension_of("m")


def is_speed(unit: str) -> bool:
    """Return whether a unit is that of a speed, and not one of counts a second."""
    return "count" not in unit and dimension_of(unit) in (dimension_of("m/s"), dimension_of("rad/s"))
