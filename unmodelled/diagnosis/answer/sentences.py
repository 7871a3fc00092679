"""A diagnosis in a few lines of text, each of which stands on its own."""

from __future__ import annotations

from collections.abc import Iterator

from unmodelled.base.wording import level_name
from unmodelled.diagnosis.answer.told import phrase, said_number
from unmodelled.diagnosis.data.gap import Gap
from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis, Estimate, Interval, Remainder
from unmodelled.effects.added import Added
from unmodelled.effects.telling import said

#: The verdicts in words.
VERDICTS = {
    "effect": "an effect that the model omits explains the gap",
    "main_effect": "an effect that the model omits explains a part of the gap, more is missing",
    "no_gap": "no law and no network predicts these logs better than the re-identified model",
    "unknown": "there is a gap that no effect of the library explains",
    "check_logs": "check the logs first, a fault of the logs explains most of the gap",
}
#: What to do next, by verdict.
NEXT_STEPS = {
    "effect": "simulate augmented_system.yaml on new logs to confirm the effect",
    "main_effect": "simulate augmented_system.yaml on new logs; index.html shows where the rest lies",
    "no_gap": "use the identified parameters; other motions can still show effects that these logs do not",
    "unknown": "see in index.html where the gap lies, then add the missing physics to the system file",
    "check_logs": "correct the logs, then diagnose again",
}
#: What to do next where the augmented system is not offered.
KEEP = "keep the system as given for simulations; see in index.html where the gap lies"
#: Ids of held-out experiments that are listed.
MOST_IDS = 4


def sentences(diagnosis: Diagnosis, exported: bool = True) -> list[str]:
    """Return a diagnosis in lines: verdict, faults, effects, parameters, gap, notes and the next step.

    Args:
        diagnosis: diagnosis with any verdict.
        exported: whether the augmented system is offered as a file, default True.
    """
    notes = [f"note: {note}" for note in diagnosis.notes]
    told = [*_verdict(diagnosis), *_numbers(diagnosis), *_gap(diagnosis), *notes]
    kept = not exported and diagnosis.verdict != "check_logs"
    return [*told, f"next: {KEEP if kept else NEXT_STEPS[diagnosis.verdict]}"]


def _verdict(diagnosis: Diagnosis) -> Iterator[str]:
    first = [fault.sentence for fault in diagnosis.faults]
    yield from () if diagnosis.verdict == "check_logs" else first  # a warning that comes before all else
    yield f"verdict: {VERDICTS[diagnosis.verdict]} (confidence {diagnosis.confidence:.2f})"
    yield from first if diagnosis.verdict == "check_logs" else ()
    for found in diagnosis.effects:
        share = 100.0 * found.shrink
        digits = 1 if 0.05 <= share < 0.95 else 0  # a small effect beside a large one
        explains = f"explains {share:.{digits}f} % of the squared gap above the noise floor"
        sure = f"confidence {found.confidence:.2f}"
        yield f"- {named(found.added)}: {found.added.law} ({explains}, {sure})"
        if text := phrase(found):
            yield f"    {text}"
        yield from (f"    {line}" for line in _law_numbers(found))
        if found.indistinguishable:
            others = ", ".join(named(added) for added in found.indistinguishable)
            yield f"    these logs cannot distinguish it from {others}: log motions in which they differ"
    if diagnosis.remainder is not None:
        yield _remainder(diagnosis.remainder, diagnosis.augmented.gap)


def _remainder(left: Remainder, gap: Gap) -> str:
    at = (
        f"; the further effect that predicts best is at {left.place.channel}"
        if left.place is not None
        else ""
    )
    predicts = f"{_percent(left.predictable)} of the whole" if left.predictable > 0.0 else "no part of it"
    return (
        f"remainder: {_percent(left.share)} of the squared error in experiments that were left out of the "
        f"fit; the gap is {_percent(gap.value / gap.persistence)} of that of persistence; a network in every "
        f"port predicts {predicts}{at}"
    )


def _percent(share: float) -> str:
    """In percent; a small share with one digit instead of none."""
    return f"{100.0 * share:.0f} %" if share >= 0.005 else f"{100.0 * share:.1g} %"


def named(added: Added) -> str:
    """Return family, place and level of an effect, such as "coulomb_friction at joint where group is old".

    Args:
        added: effect with its place.
    """
    kind = f"{added.family} ({added.variant})" if added.variant else added.family
    place = added.place
    only = "" if place.factor is None else f" where {level_name(place.factor, place.level)}"
    return f"{kind} at {place.channel}{only}"


def _law_numbers(found: DiagnosedEffect) -> Iterator[str]:
    for name in found.estimates:
        number = said_number(found, name)
        value, *interval = number.values
        whole = "" if number.whole is None else f" of {number.whole:.4g}"
        words = f", {number.words}" if number.words else ""
        told = f"{number.symbol} = {value:.4g}{whole}{_unit(number.unit)}"
        yield f"{told} ({_interval((interval[0], interval[1]))}){words}"
    for name, values in found.own.items():
        number = said(found.added, name, list(values.values()))
        spread = f"{min(number.values):.4g} to {max(number.values):.4g}"
        yield f"{number.symbol} = {spread}{_unit(number.unit)}, fitted per experiment"


def _numbers(diagnosis: Diagnosis) -> Iterator[str]:
    for name, e in diagnosis.parameters.items():
        yield f"{name} = {_with_interval(e)}, {e.known:.4g}{_unit(e.unit)} in the system file"


def _with_interval(e: Estimate) -> str:
    return f"{e.value:.4g}{_unit(e.unit)} ({_interval(e.interval)})"


def _gap(diagnosis: Diagnosis) -> Iterator[str]:
    if diagnosis.verdict == "check_logs":
        for name, off in diagnosis.known.gap.units.items():
            yield f"{name}: {off.says(diagnosis.horizon)}"
        yield f"gap of the known model: {diagnosis.known.gap.value:.3g} standard deviations of the outputs"
        yield _persistence(diagnosis)
        return
    label = "with the effects found" if diagnosis.effects else "re-identified"
    for name, off in diagnosis.known.gap.units.items():
        after = diagnosis.augmented.gap.units[name].says(diagnosis.horizon)
        yield f"{name}: {off.says(diagnosis.horizon)}; {label}: {after}"
    models = ("known", "reidentified", "augmented", "neural")
    values = ", ".join(f"{name} {getattr(diagnosis, name).gap.value:.3g}" for name in models)
    ids = [diagnosis.logs.ids[i] for i in diagnosis.held_out]
    more = f" and {len(ids) - MOST_IDS} more" if len(ids) > MOST_IDS else ""
    yield (
        f"gap: {values}, noise floor {diagnosis.floor:.3g} (in standard deviations of the outputs, on "
        f"held-out experiments {', '.join(ids[:MOST_IDS])}{more})"
    )
    yield _persistence(diagnosis)
    low, high = (100.0 * end for end in diagnosis.interval)
    yield (
        f"shrink: {100.0 * diagnosis.shrink:.0f} % of the squared gap above the noise floor "
        f"(95 % interval {low:.0f} to {high:.0f} %)"
    )


def _persistence(diagnosis: Diagnosis) -> str:
    value = diagnosis.known.gap.persistence
    return f"persistence: {value:.3g}, the error if every output kept its value or its speed"


def _unit(unit: str) -> str:
    return "" if unit in ("", "1", "-") else f" {unit}"


def _interval(interval: Interval) -> str:
    low, high = interval
    digits = next((n for n in range(4, 10) if f"{low:.{n}g}" != f"{high:.{n}g}"), 4)
    return f"95 % interval {low:.{digits}g} to {high:.{digits}g}"
