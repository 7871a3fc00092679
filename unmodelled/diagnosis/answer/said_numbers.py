"""Numbers of effects as a person says them, and effects in a few words."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from unmodelled.base.wording import amounts, changed, part_of
from unmodelled.diagnosis.answer.guesses import Over
from unmodelled.diagnosis.data.result import DiagnosedEffect
from unmodelled.diagnosis.doubts.usual_mistakes import mistake_of
from unmodelled.effects.added import Added
from unmodelled.effects.telling import Said, said, told_wave

#: Significant digits of a number in a phrase; of a ratio there, which has no unit, one less.
SAID_DIGITS = 3


def shown_number(added: Added, name: str, entry: Mapping[str, Any], over: Over | None) -> dict[str, Any]:
    """Return the entry `shown` of a number, as a person says it; nothing where the number is said as it is.

    A number that rests on a guess is said over the guess.
    """
    number = said(added, name, (entry["value"], *entry["interval"]))
    value, *interval = number.values
    plain = (number.symbol, number.words, number.unit) == (name, "", added.units[name])
    if plain and over is None:
        return {}
    symbol, words, unit = number.symbol, number.words, number.unit
    if over is not None and number.symbol == name and number.whole is None:
        words = f"in {unit} only once {over.missing} is known"
        symbol, unit = over.symbol.format(name), over.unit
        value, *interval = (each / over.divisor for each in (entry["value"], *entry["interval"]))
    elif over is not None:
        words = ", ".join(filter(None, (words, f"if {' and '.join(over.given)}")))
    about = {"symbol": symbol, "words": words, "value": value, "unit": unit}
    whole = {} if number.whole is None else {"whole": number.whole}
    return {"shown": {**about, "interval": interval, **whole}}


def phrase(found: DiagnosedEffect, over: Collection[str]) -> str:
    """Return an effect in a few words with its numbers; "" where its law has none, or a number is doubtful.

    A number over a guess is doubtful, too.
    """
    text, numbers = found.added.phrase, found.estimates
    first = next(iter(numbers.values()), None)
    against = first is not None and first.value < 0.0 and bool(found.added.negative)
    text = found.added.negative if against else text
    named = {name for name in numbers if f"{{{name}}}" in text}
    waves = (wave for name, wave in found.added.waves.items() if name in named)
    beside = {str(name) for wave in waves for name in (wave.cosine, wave.times)} & numbers.keys()
    if (
        not text
        or text.count("{") != len(named)
        or not all(numbers[name].sure and name not in over for name in named | beside)
    ):
        return ""
    return text.format_map(
        {name: _told(found, name, against and name == next(iter(numbers))) for name in named}
    )


def _told(found: DiagnosedEffect, name: str, without_sign: bool) -> str:
    """A number of an effect with its unit, or the wave of which it is the amplitude of the sine."""
    values = {n: estimate.value for n, estimate in found.estimates.items()}
    values[name] = abs(values[name]) if without_sign else values[name]
    if name in found.added.waves:
        return told_wave(found.added, name, values, SAID_DIGITS)
    return _amount(said(found.added, name, (values[name],)))


def _amount(number: Said) -> str:
    """The first value of a number with its unit, beside the whole of which it is a part."""
    (value, *_) = number.values
    if number.instead is not None:
        mistake = mistake_of(number.instead, value)
        return changed(value, number.instead, number.unit) + (f" ({mistake})" if mistake else "")
    if number.whole is not None:
        return part_of(value, number.whole, number.unit)
    ratio = number.unit in ("", "1", "-")
    return amounts([value], number.unit, SAID_DIGITS - ratio)[0]
