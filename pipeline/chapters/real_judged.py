"""Whether a diagnosis of a measured machine agrees with what is known of this machine from elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations
from typing import Any

from pipeline.chapters.known import KNOWN_PHYSICS, KnownCase, Reference

Report = Mapping[str, Any]

#: Verdicts that name effects.
ASSERTING = ("effect", "main_effect")


def named(effect: Mapping[str, Any]) -> str:
    """Return family and place of an effect, such as "coulomb_friction at rail"."""
    place = effect.get("port")
    return f"{effect['family']} at {place}" if place else str(effect["family"])


def asserted(report: Report) -> Sequence[Mapping[str, Any]]:
    """Return the effects that the verdict asserts."""
    effects: Sequence[Mapping[str, Any]] = report["effects"]
    return effects if report["verdict"] in ASSERTING else ()


def judged(case: KnownCase, report: Report) -> dict[str, Any]:
    """Return how a diagnosis compares with what is known."""
    effects = asserted(report)
    families = [frozenset(_family(name) for name in names) for names in case.effects]
    sayings = [_said(effect) for effect in effects]
    inside = [is_inside(reference, report) for reference in case.numbers]
    faults = [*_faults(case, report)]
    return {
        "names right": _count(_told(families, [frozenset(map(_family, names)) for names in sayings])),
        "places right": _count(_told(case.effects, sayings)),
        "numbers inside": _count([found for found in inside if found is not None]),
        "holds": "no" if faults else "yes",
        "harmful": "yes" if _is_harmful(case, report) else "no",
        "failed at": "; ".join(faults),
    }


def is_inside(reference: Reference, report: Report) -> bool | None:
    """Return whether a reference lies in the 95 % interval of its number; None where there is no interval.

    A reference that is a range lies inside if it overlaps the interval.
    """
    identified = parameters(report).get((reference.of, reference.parameter))
    if identified is None or None in (interval := identified["interval"] or [None]):
        return None
    low, high = interval
    return bool(low <= reference.high and reference.low <= high)


def parameters(report: Report) -> dict[tuple[str, str], dict[str, Any]]:
    """Return the identified numbers by owner (effect, or known physics) and name."""
    own = {(KNOWN_PHYSICS, name): dict(values) for name, values in report["parameters"].items()}
    return own | {
        (named(effect), name): {"identified": values["value"], **values}
        for effect in report["effects"]
        for name, values in effect["parameters"].items()
    }


def _said(effect: Mapping[str, Any]) -> frozenset[str]:
    """Names of an effect and of those that the logs cannot distinguish from it."""
    return frozenset(map(named, (effect, *effect["indistinguishable"])))


def _told(wanted: Sequence[frozenset[str]], said: Sequence[frozenset[str]]) -> list[bool]:
    """For each wanted effect: whether it is said, as many as possible; one saying stands for one effect."""
    best = [False] * len(wanted)
    for chosen in permutations([*said, *[frozenset[str]()] * len(wanted)], len(wanted)):
        told = [bool(names & one) for names, one in zip(wanted, chosen, strict=True)]
        best = max(best, told, key=sum)
    return best


def _family(name: str) -> str:
    return name.partition(" at ")[0]


def _count(found: Sequence[bool]) -> str:
    return f"{sum(found)} of {len(found)}" if found else ""


def _is_harmful(case: KnownCase, report: Report) -> bool:
    if any(not case.right & _said(effect) for effect in asserted(report)):
        return True
    return report["verdict"] in ("no_gap", "check_logs") and report["verdict"] not in case.verdicts


def _faults(case: KnownCase, report: Report) -> Iterator[str]:
    """The parts of a diagnosis that failed, in the order in which a diagnosis goes through them."""
    verdict, effects = report["verdict"], asserted(report)
    if verdict in ("check_logs", "no_gap") and verdict not in case.verdicts:
        yield "check of the logs" if verdict == "check_logs" else "noise floor: the gap counts as noise"
        return
    told = _told(case.effects, [_said(effect) for effect in effects])
    missing = [names for names, found in zip(case.effects, told, strict=True) if not found]
    if verdict != "main_effect" or len(missing) == len(case.effects):
        yield from (_missed(names, report) for names in missing)
    for effect in effects:
        if not case.right & _said(effect):
            yield f"choice: {named(effect)} is not known of this machine"
    if verdict not in case.verdicts and not missing:
        yield f"verdict: must be {' or '.join(sorted(case.verdicts))}"


def _missed(names: frozenset[str], report: Report) -> str:
    name = " or ".join(sorted(names))
    if any(names & _said(effect) for effect in report["effects"]):
        return f"choice: one effect is named in place of {name} and another effect"
    tried = [c["difference"] for c in report["comparison"] if names & {*map(named, c["effects"])}]
    if tried:
        return (
            f"choice: {name} was fitted, its score is {min(tried):.3g} nats from that of the named candidate"
        )
    return f"search: {name} was not fitted"
