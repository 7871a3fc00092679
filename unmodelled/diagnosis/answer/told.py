"""A diagnosed effect in the words of the trade and the units of the logs."""

from __future__ import annotations

from typing import Any

import numpy as np

from unmodelled.base.wording import amounts, part_of
from unmodelled.diagnosis.data.result import DiagnosedEffect
from unmodelled.effects.telling import Said, said

#: Significant digits of a number in a phrase; of a ratio, which has no unit, one less.
DIGITS = 3


def said_number(found: DiagnosedEffect, name: str) -> Said:
    """Return value and 95 % interval of a number as a person says them; of single experiments mean
    and range.
    """
    if name in found.own:
        each = np.array(list(found.own[name].values()))
        return said(found.added, name, (float(each.mean()), *np.quantile(each, [0.025, 0.975]).tolist()))
    estimate = found.estimates[name]
    return said(found.added, name, (estimate.value, *estimate.interval))


def shown(found: DiagnosedEffect, name: str) -> dict[str, Any]:
    """Return the entry `shown` of a number in diagnosis.json; nothing where the number is said as it is."""
    number = said_number(found, name)
    value, *interval = number.values
    if (number.symbol, number.words, number.unit) == (name, "", found.added.units[name]):
        return {}
    about = {"symbol": number.symbol, "words": number.words, "value": value, "unit": number.unit}
    whole = {} if number.whole is None else {"whole": number.whole}
    return {"shown": {**about, "interval": interval, **whole}}


def phrase(found: DiagnosedEffect) -> str:
    """Return an effect in a few words with its numbers; "" where its law has none, or a number is open."""
    text, numbers = found.added.phrase, found.estimates
    named = {name for name in numbers if f"{{{name}}}" in text}
    if not text or text.count("{") != len(named) or not all(numbers[name].determined for name in named):
        return ""
    return text.format_map({name: amount(said(found.added, name, (numbers[name].value,))) for name in named})


def amount(number: Said) -> str:
    """Return the first value of a number with its unit, beside the whole of which it is a part."""
    (value, *_) = number.values
    if number.whole is not None:
        return part_of(value, number.whole, number.unit)
    ratio = number.unit in ("", "1", "-")
    return amounts([value], number.unit, DIGITS - ratio)[0]
