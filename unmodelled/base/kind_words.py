"""Kinds of laws, their probabilities and experiments that follow no law, in words, as answers tell them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from unmodelled.base.errors import first_few
from unmodelled.base.wording import effect_name, law_name

Entry = Mapping[str, Any]

#: Kinds of laws whose name alone says too little, in words.
KINDS = {
    "play": "transmission play or compliance",
    "number": "parameter deviation",
    "drive": "actuation error",
    "sensor": "measurement error",
    "timing": "delay or lag",
    "curve": "effort of another form",
}
#: Forms of a law that a sentence lists.
MOST_FORMS = 4
#: Kinds that a ranking lists, and probability below which it lists none.
MOST_TOLD, LEAST_TOLD = 3, 0.005
#: What a ranking calls the model without a law, and all laws that it does not list.
NOTHING, ELSE = "nothing", "something else"
#: What makes the place of a law.
_SHARED = ("port", "factor", "level", "signal")
_PLACE = ("parameter", *_SHARED)


def kind_name(effect: Entry) -> str:
    """Return kind and place of an effect of diagnosis.json that has a kind.

    Examples:
        >>> kind_name({"kind": "dry friction", "port": "joint"})
        'dry friction at joint'
        >>> kind_name({"kind": "number", "port": "joint", "parameter": "b"})
        'parameter deviation of b'
    """
    return effect_name({**effect, "family": KINDS.get(effect["kind"], effect["kind"]), "variant": ""})


def ranking(content: Entry, effect: Entry) -> list[tuple[str, float]]:
    r"""Return the kinds and places between which a diagnosis chose an effect, with their probabilities.

    The most likely one is first, the last one is something else. They are sums over the rows of `comparison`.

    Examples:
        >>> joint = {"family": "coulomb_friction", "port": "joint", "kind": "dry friction"}
        >>> spring = {"family": "linear_spring", "port": "joint", "kind": "elasticity"}
        >>> rows = [
        ...     {"effects": [joint], "named": True, "probability": 0.7},
        ...     {"effects": [spring], "named": False, "probability": 0.2},
        ...     {"effects": [], "named": False, "probability": 0.001},
        ... ]
        >>> for name, share in ranking({"comparison": rows}, {**joint, "confidence": 0.7}):
        ...     print(name, f"{share:.2f}")
        dry friction at joint 0.70
        elasticity at joint 0.20
        something else 0.10
    """
    groups: dict[tuple[object, ...], list[Entry]] = {}
    for one in _beside(content, effect) or _members(effect):
        groups.setdefault(tuple(one.get(name) for name in ("kind", *_SHARED)), []).append(one)
    found = [(_group_name(members), sum(e["probability"] for e in members)) for members in groups.values()]
    told = sorted((row for row in found if row[1] >= LEAST_TOLD), key=lambda row: -row[1])[:MOST_TOLD]
    return [*told, (ELSE, max(0.0, 1.0 - sum(share for _, share in told)))]


def _beside(content: Entry, effect: Entry) -> list[Entry]:
    """The last effects of the rows between which an effect was chosen: beside the same effects before it."""
    named: Sequence[Entry] = next(
        (row["effects"] for row in content.get("comparison", ()) if row["named"]), []
    )
    at = next((k for k, one in enumerate(named) if _label(one) == _label(effect)), None)
    if at is None:
        return []
    before = [_label(one) for one in named[:at]]
    rows = (row for row in content["comparison"] if row.get("probability") is not None)
    return [
        {**(row["effects"][-1] if row["effects"] else {}), "probability": row["probability"]}
        for row in rows
        if (not row["effects"] and at == 0)
        or (len(row["effects"]) == at + 1 and [_label(one) for one in row["effects"][:at]] == before)
    ]


def _members(effect: Entry) -> list[Entry]:
    """An effect and those that the logs cannot tell from it, where no comparison is known."""
    known = [one for one in (effect, *effect.get("indistinguishable", ())) if "probability" in one]
    return known or [{**effect, "probability": effect["confidence"]}]


def _label(effect: Entry) -> tuple[object, ...]:
    return tuple(effect.get(name) for name in ("family", "variant", *_PLACE))


def _group_name(members: Sequence[Entry]) -> str:
    """Kind and place; the parameter only where all likely members have the same."""
    best = max(members, key=lambda one: float(one["probability"]))
    if not best.get("kind"):
        return NOTHING
    likely = [one for one in members if one["probability"] >= LEAST_TOLD] or [best]
    same = len({one.get("parameter") for one in likely}) == 1
    return kind_name(best if same else {**best, "parameter": None})


def ranking_sentence(content: Entry, effect: Entry) -> str:
    """Return the ranking of `ranking` as one line, such as "Dry friction at joint 90 %, ..."."""
    text = ", ".join(f"{name} {_percent(share)}" for name, share in ranking(content, effect))
    return text[:1].upper() + text[1:]


def kind_sentence(effect: Entry) -> str:
    r"""Return the forms that the kind of an effect may have with their probabilities, then other kinds.

    Examples:
        >>> other = {"family": "coulomb_friction", "port": "joint", "kind": "dry friction"}
        >>> dahl = {"family": "hysteresis", "variant": "dahl", "port": "joint", "kind": "dry friction"}
        >>> alike = [{**other, "probability": 0.23}]
        >>> shares = {"confidence": 0.94, "probability": 0.71, "indistinguishable": alike}
        >>> kind_sentence(dahl | shares).replace("\xa0", " ")
        'Form: hysteresis (Dahl) 71 %, Coulomb friction 23 %.'

        The plainest law is named, also where another kind is likelier:

        >>> viscous = {**other, "family": "viscous_friction", "kind": "damping", "probability": 0.33}
        >>> rare = {**other, "confidence": 0.34, "probability": 0.01, "indistinguishable": [viscous]}
        >>> forms, _, why = kind_sentence(rare).replace("\xa0", " ").partition(" These logs ")
        >>> print(forms, why, sep=chr(10))
        Form: Coulomb friction 1 %. Other kinds: viscous friction 33 %.
        cannot tell them apart; Coulomb friction is named as the plainest.
    """
    kind = effect["kind"]
    members = sorted([effect, *effect["indistinguishable"]], key=lambda each: -each.get("probability", 0.0))
    forms = [each for each in members if each.get("kind", kind) == kind]
    others = [each for each in members if each not in forms]
    text = f"Form: {_listed(forms, effect)}."
    text = f"{text} Other kinds: {_listed(others, effect)}." if others else text
    if members[0] is effect or "probability" not in effect:
        return text
    law = law_name(effect["family"], effect.get("variant") or "")
    return f"{text} These logs cannot tell them apart; {law} is named as the plainest."


def strangers_sentence(ids: Sequence[str]) -> str:
    """Return which experiments the named effects do not predict better, and what to do.

    Examples:
        >>> strangers_sentence(["run7"])
        'Experiment run7 does not follow this law: look at what was different there.'
        >>> strangers_sentence(["run2", "run7"])
        'Experiments run2 and run7 do not follow this law: look at what was different there.'
    """
    *others, last = ids
    listed = f"{', '.join(others)} and {last}" if others else last
    who = f"Experiments {listed} do" if others else f"Experiment {last} does"
    return f"{who} not follow this law: look at what was different there."


def _listed(members: Sequence[Entry], effect: Entry) -> str:
    named = [
        f"{_form(each, effect)} {_percent(each['probability'])}"
        if "probability" in each
        else _form(each, effect)
        for each in members
    ]
    return first_few(named, MOST_FORMS)


def _form(each: Entry, effect: Entry) -> str:
    """Law of one kind; its place only where it acts elsewhere."""
    here = all(each.get(name) == effect.get(name) for name in _PLACE)
    return law_name(each["family"], each.get("variant") or "") if here else effect_name(each)


def _percent(share: float) -> str:
    return "below\u00a01\u00a0%" if share < 0.005 else f"{100.0 * share:.0f}\u00a0%"
