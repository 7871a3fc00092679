"""The verdict of a diagnosis in one sentence."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from unmodelled.base.kind_words import kind_name, ranking_sentence
from unmodelled.base.sure_numbers import as_said, doubt, main_number
from unmodelled.base.wording import PLACES, effect_name, law_name, level_name, place_name
from unmodelled.report.numbers import amounts, number

#: Places from which on an effect is told once for all of them.
MANY = 3
#: Title of an answer with the verdict unknown.
UNEXPLAINED = "No law of the library explains the gap."
#: What an unexplained gap looks like by the kind of the channel where it enters; at a port, an effort.
ORIGINS = {"actuator": "an error", "sensor": "an error", "parameter": "another value"}


def headline(content: Mapping[str, Any]) -> str:
    """Return the verdict of diagnosis.json as one sentence."""
    names = _each(content["effects"], _name_of)
    together, shrink = " and ".join(names), percent(content["gap"]["shrink"])
    if content["verdict"] == "check_logs":
        return "Check the logs first."
    if content["verdict"] == "no_gap":
        return "No gap that matters."
    if content["verdict"] in ("effect", "main_effect"):
        verb = "explains" if len(names) == 1 else "explain"
        sure = percent(content["confidence"])
        more = "; more is missing" if content["verdict"] == "main_effect" else ""
        if ranked := rankings(content):
            return f"{ranked}. Explained: {shrink} of the gap{more}."
        return f"{_capital(together)} {verb} {shrink} of the gap (confidence {sure}){more}."
    return " ".join([UNEXPLAINED, *left_looks_like(content)])


def rankings(content: Mapping[str, Any]) -> str:
    """Return the kinds between which each effect was chosen; empty where laws have no kinds."""
    ranked = [ranking_sentence(content, effect) for effect in content["effects"] if effect.get("kind")]
    if len(ranked) < 2:
        return "".join(ranked)
    pairs = (each.partition(", ") for each in ranked)
    first, *others = (f"{kind} ({rest})" for kind, _, rest in pairs)
    return " and ".join([first, *(f"{each[:1].lower()}{each[1:]}" for each in others)])


def left_looks_like(content: Mapping[str, Any]) -> list[str]:
    """Return what an unexplained gap looks like and is most alike, as one sentence; none without a place."""
    where, found = content["where"], list[str]()
    parts = [f"{_origin(row['port'])} ({_share_of(row)})" for row in where["channels"][:1]]
    levels = [(level_name(row["factor"], row["level"]), row) for row in where["factors"][:1]]
    parts += [f"mostly where {level} ({_share_of(row)})" for level, row in levels]
    if where["channels"]:
        found.append(f"what is left looks like {', '.join(parts)}")
    if alike := content.get("alike"):
        law = law_name(alike["family"], alike.get("variant") or "")
        found.append(f"most alike: {kind_name(alike)}, such as {law}")
    return [f"{_capital('; '.join(found))}."] if found else []


def _origin(channel: str) -> str:
    kind = channel.partition(":")[0] if ":" in channel else ""
    return f"{ORIGINS.get(kind, 'an effort')} at {place_name(channel)}"


def _share_of(row: Mapping[str, Any]) -> str:
    return f"{percent(row['share'])} of the gap"


def outcome(content: Mapping[str, Any]) -> str:
    """Return what was found as one sentence with amounts in units, or the verdict where nothing was found."""
    gap, shown = content["gap"], fallen(content)
    if not content["effects"] or not shown:
        return headline(content)
    *others, last = _each(content["effects"], _amount_of)
    together = f"{', '.join(others)} and {last}" if others else last
    name, entry = shown[0]
    before, after = (amounts([entry[model]], entry["unit"])[0] for model in ("known", "augmented"))
    of, (late,) = f" of {name}" if len(gap["units"]) > 1 else "", amounts([gap["horizon"]], "s")
    return (
        f"{_capital(together)}: the error{of} after {late} falls from {before} to {after} "
        "on experiments that took no part in the fit."
    )


def _capital(text: str) -> str:
    """Text at the beginning of a sentence; a name, as of a parameter that has another value, stays."""
    return text if text.partition(" ")[2].startswith("=") else text[:1].upper() + text[1:]


def fallen(content: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the outputs whose error falls, each with its entry of `gap.units`."""
    every = ((name, as_said(entry)) for name, entry in content["gap"]["units"].items())
    return [
        (name, said)
        for name, said in every
        if None not in (said["known"], said["augmented"]) and said["augmented"] < said["known"]
    ]


def remains(content: Mapping[str, Any]) -> str:
    """Return what remains of the gap as one sentence; empty where no effect was found."""
    gap, left = content["gap"], content.get("remainder")
    if not content["effects"] or not gap["floor"]:
        return ""
    start = "More is missing: what" if content["verdict"] == "main_effect" else "What"
    times = float(f"{gap['augmented'] / gap['floor']:.2g}")
    size = f"{number(times)} times" if times > 1.0 else "no more than"
    text = f"{start} remains is {size} the error that sensor noise alone causes"
    if not left:
        return f"{text}."
    part = f"{percent(left['predictable'])} of the whole" if left["predictable"] else "no part of it"
    return f"{text}: {percent(left['share'])} of the squared error; a network in every port predicts {part}."


def _each(effects: Sequence[Mapping[str, Any]], told: Callable[[Mapping[str, Any]], str]) -> list[str]:
    """Texts of effects; an effect at many places is told once, with the range of its numbers."""
    kinds: dict[object, list[Mapping[str, Any]]] = {}
    for effect in effects:
        kinds.setdefault((effect["family"], effect.get("variant")), []).append(effect)
    texts: list[str] = []
    for alike in kinds.values():
        if len(alike) < MANY:
            texts += map(told, alike)
            continue
        numbers = [entry for entry in map(main_number, alike) if entry is not None]
        # the first number of one of them may be zero, and the next one something else
        same = [entry["value"] for entry in numbers if entry["unit"] == numbers[0]["unit"]]
        ends = [pick(same) for pick in (min, max)] if same else []
        which = "" if len(same) == len(alike) else f" at {len(same)} of them"
        span = f" ({' to '.join(amounts(ends, numbers[0]['unit'], 3))}{which})" if numbers else ""
        unsure = "" if span or not all(map(doubt, alike)) else " (size uncertain)"
        texts.append(f"{effect_name(alike[0]).split(' at ')[0]} at {len(alike)} places{span}{unsure}")
    return texts


def _name_of(effect: Mapping[str, Any]) -> str:
    """An effect, with what is doubtful about its size."""
    unsure = doubt(effect)
    return f"{effect_name(effect)} ({unsure})" if unsure else effect_name(effect)


def _amount_of(effect: Mapping[str, Any]) -> str:
    """An effect with the first of its numbers that has a unit and differs from zero, such as an amplitude."""
    name = effect_name(effect)
    if doubt(effect):
        return _name_of(effect)
    if effect.get("text"):
        between = ", at " if set(effect["text"]) & {",", ";"} else " at "
        place = name.partition(" at ")[2]
        return f"{effect['text']}{between}{place}" if place else str(effect["text"])
    for kind in PLACES.values():  # a sensor delay at sensor theta is a delay at sensor theta
        name = name.removeprefix(f"{kind} ") if f" at {kind} " in name else name
    entry = main_number(effect)
    return f"{amounts([entry['value']], entry['unit'], 3)[0]} of {name}" if entry else name


def percent(value: float | None) -> str:
    """Format a share in percent; neither nearly all is rounded to 100 % nor a little to 0 %."""
    if value is None:
        return "–"
    share = 100.0 * value
    little, most = 0.05 <= share < 0.95, 99.0 < share < 99.95
    return f"{share:.1f}\u202f%" if little or most else f"{share:.0f}\u202f%"
