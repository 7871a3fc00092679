"""A diagnosis in a few lines of text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from unmodelled.diagnosis.data.result import DiagnosedEffect, Diagnosis, Estimate, Interval
from unmodelled.effects.added import Added

VERDICTS = {
    "effect": "the gap is due to an effect that the model leaves out",
    "no_gap": "no gap beyond what noise explains",
    "unknown": "there is a gap, and no effect of the library explains it",
    "check_logs": "check the logs first",
}


def sentences(diagnosis: Diagnosis) -> list[str]:
    """Verdict, faults of the logs, effects with their numbers, parameters, the gap, and notes."""
    return [*_verdict(diagnosis), *_numbers(diagnosis), *_gap(diagnosis)] + [
        f"note: {note}" for note in diagnosis.notes
    ]


def _verdict(diagnosis: Diagnosis) -> Iterator[str]:
    first = [fault.sentence for fault in diagnosis.faults]
    yield from () if diagnosis.verdict == "check_logs" else first  # a warning that comes before all else
    yield f"verdict: {VERDICTS[diagnosis.verdict]} (confidence {diagnosis.confidence:.2f})"
    yield from first if diagnosis.verdict == "check_logs" else ()
    for found in diagnosis.effects:
        part = "explains part of it: " if diagnosis.partial else ""
        shrinks = f"the gap shrinks by {100.0 * found.shrink:.0f} %, confidence {found.confidence:.2f}"
        yield f"- {part}{named(found.added)}: {found.added.law} ({shrinks})"
        yield from (f"    {line}" for line in _law_numbers(found))
        if found.indistinguishable:
            others = ", ".join(named(added) for added in found.indistinguishable)
            yield f"    these data cannot tell it from {others}"


def named(added: Added) -> str:
    """Which effect, where, and in which experiments."""
    kind = f"{added.family} ({added.variant})" if added.variant else added.family
    level = added.place.level
    shown = f"{level:g}" if isinstance(level, float) else level
    only = f" where {added.place.factor} is {shown}" if added.place.factor is not None else ""
    return f"{kind} at {added.place.channel}{only}"


def _law_numbers(found: DiagnosedEffect) -> Iterator[str]:
    for name, e in found.estimates.items():
        yield f"{name} = {e.value:.4g}{_unit(e.unit)} {_interval(e.interval)}"
    for name, values in found.own.items():
        yield f"{name}: {_spread(values)}{_unit(found.added.units[name])}, one for each experiment"


def _spread(values: Mapping[str, float]) -> str:
    each = np.array(list(values.values()))
    return f"{each.min():.4g} to {each.max():.4g}"


def _numbers(diagnosis: Diagnosis) -> Iterator[str]:
    for name, e in diagnosis.parameters.items():
        yield f"{name}: {_identified(e)}"


def _identified(e: Estimate) -> str:
    return f"{e.known:.4g}{_unit(e.unit)} in the file, identified as {e.value:.4g} {_interval(e.interval)}"


def _gap(diagnosis: Diagnosis) -> Iterator[str]:
    if diagnosis.verdict == "check_logs":
        for name, off in diagnosis.known.gap.units.items():
            yield f"{name}: {off.says(diagnosis.horizon)}"
        yield f"gap: known {diagnosis.known.gap.value:.3g} (standard deviations)"
        return
    label = "with the effects found" if diagnosis.effects else "re-identified"
    for name, off in diagnosis.known.gap.units.items():
        after = diagnosis.augmented.gap.units[name].says(diagnosis.horizon)
        yield f"{name}: {off.says(diagnosis.horizon)}; {label}: {after}"
    models = ("known", "reidentified", "augmented", "neural")
    values = ", ".join(f"{name} {getattr(diagnosis, name).gap.value:.3g}" for name in models)
    ids = [diagnosis.logs.ids[i] for i in diagnosis.held_out]
    held = f"{', '.join(ids[:4])}{f' and {len(ids) - 4} more' if len(ids) > 4 else ''}"
    yield f"gap: {values}, noise floor {diagnosis.floor:.3g} (standard deviations, held out: {held})"
    low, high = diagnosis.interval
    yield f"shrink: {100.0 * diagnosis.shrink:.0f} % [{100.0 * low:.0f}, {100.0 * high:.0f}]"


def _unit(unit: str) -> str:
    return "" if unit in ("", "1", "-") else f" {unit}"


def _interval(interval: Interval) -> str:
    low, high = interval
    return f"[{low:.4g}, {high:.4g}]"
