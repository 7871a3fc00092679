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
#: What makes the place of a law.
_PLACE = ("port", "parameter", "factor", "level", "signal")


def kind_name(effect: Entry) -> str:
    """Return kind and place of an effect of diagnosis.json that has a kind.

    Examples:
        >>> kind_name({"kind": "dry friction", "port": "joint"})
        'dry friction at joint'
        >>> kind_name({"kind": "number", "port": "joint", "parameter": "b"})
        'parameter deviation of b'
    """
    return effect_name({**effect, "family": KINDS.get(effect["kind"], effect["kind"]), "variant": ""})


def kind_sentence(effect: Entry) -> str:
    r"""Return kind and place of an effect with the probability of the kind, then its forms with theirs.

    Examples:
        >>> other = {"family": "coulomb_friction", "port": "joint", "kind": "dry friction"}
        >>> dahl = {"family": "hysteresis", "variant": "dahl", "port": "joint", "kind": "dry friction"}
        >>> alike = [{**other, "probability": 0.23}]
        >>> shares = {"confidence": 0.94, "probability": 0.71, "indistinguishable": alike}
        >>> kind_sentence(dahl | shares).replace("\xa0", " ")
        'Dry friction at joint, 94 %. Form: hysteresis (Dahl) 71 %, Coulomb friction 23 %.'

        The plainest law is named, also where another kind is likelier:

        >>> viscous = {**other, "family": "viscous_friction", "kind": "damping", "probability": 0.33}
        >>> rare = {**other, "confidence": 0.34, "probability": 0.01, "indistinguishable": [viscous]}
        >>> kind_sentence(rare).replace("\xa0", " ").partition(". ")[0]
        'Dry friction at joint, or what these logs cannot tell from it, 34 %'
    """
    kind = effect["kind"]
    members = sorted([effect, *effect["indistinguishable"]], key=lambda each: -each.get("probability", 0.0))
    forms = [each for each in members if each.get("kind", kind) == kind]
    others = [each for each in members if each not in forms]
    known = "probability" in effect
    share = sum(each.get("probability", 0.0) for each in forms) if known else effect["confidence"]
    name = kind_name(effect)
    if share < 0.5 * effect["confidence"]:
        name, share = f"{name}, or what these logs cannot tell from it", effect["confidence"]
    text = f"{name[:1].upper()}{name[1:]}, {_percent(share)}. Form: {_listed(forms, effect)}."
    return f"{text} Other kinds: {_listed(others, effect)}." if others else text


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
