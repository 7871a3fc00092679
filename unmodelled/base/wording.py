"""Names of laws and places in words, as answers tell them."""

from __future__ import annotations

import re

#: Digits and sign of an exponent, raised.
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Proper names in families of effects and their variants.
NAMES = ("Coulomb", "Stribeck", "Bouc-Wen", "Dahl", "LuGre")
#: What kinds of channels are called.
PLACES = {"actuator": "input", "sensor": "sensor", "parameter": "parameter"}


def law_name(family: str, variant: str = "") -> str:
    """Return family and variant of an effect in words; a variant may be a formula.

    Args:
        family: name of the family.
        variant: name of the variant, or a formula; default: the plain form.

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

    Args:
        channel: name of a channel in diagnosis.json.

    Examples:
        >>> place_name("actuator:u"), place_name("rail")
        ('input u', 'rail')
    """
    kind, _, name = channel.rpartition(":")
    return f"{PLACES.get(kind, kind)} {name}".strip()


def level_name(factor: str, level: float | str | None) -> str:
    """Return an entry in a column of experiments.csv in words.

    Args:
        factor: name of the column.
        level: the entry.

    Examples:
        >>> level_name("load", 1.0), level_name("oil", "old")
        ('load is 1', 'oil is old')
    """
    return f"{factor} is {f'{level:g}' if isinstance(level, float) else level}"
