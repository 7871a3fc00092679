"""Library of all effects: every class in the files of this package that makes one, and those of packages."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from functools import cache
from typing import Any

from unmodelled import effects as package
from unmodelled.base.additions import additions
from unmodelled.base.errors import BadInput
from unmodelled.effects.added import Added
from unmodelled.effects.effect import PLACE_KINDS, Effect, LawKind, PortEffect
from unmodelled.systems.model import System
from unmodelled.systems.units import parse_unit

#: Group of entry points by which other packages add laws; each names an object, not a class.
GROUP = "unmodelled.laws"
#: What a balance loses, by the unit of its effort.
LOSSES = {"W": "heat loss", "m^3/s": "outflow", "kg/s": "outflow", "A": "leakage"}


@cache
def effects() -> tuple[Effect, ...]:
    """Return one object of each effect, by family; the basic law of a family first."""
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    kinds = dict.fromkeys(_below(Effect))  # a class with two bases comes twice
    ours = (kind for kind in kinds if kind.__module__.startswith(f"{package.__name__}."))
    found = [kind() for kind in ours if _makes_one(kind)]
    found += _of_packages({effect.family for effect in found})
    return tuple(sorted(found, key=lambda effect: (effect.family, effect.variant)))


@cache
def _kinds() -> dict[tuple[str, str], LawKind]:
    return {(effect.family, effect.variant): effect.kind for effect in effects()}


def kind_of(added: Added) -> str:
    """Return the kind of a law; that of its place for a law that is not in the library.

    A loss is called by what a balance loses.
    """
    kind = _kinds().get((added.family, added.variant), PLACE_KINDS[added.place.kind])
    if kind != "loss":
        return kind
    own = parse_unit(added.system.port(added.place.name).unit).dimension
    return next((words for unit, words in LOSSES.items() if parse_unit(unit).dimension == own), kind)


def without_own_laws(system: System) -> tuple[str, ...]:
    """Return a note on every port at which no law of its domain can act, or on a system without ports."""
    if not system.ports:
        return (
            "the system file has no port: errors of drives, sensors and parameters were tried, no friction, "
            "spring or loss; name the effort that may be missing in ports and dynamics, then diagnose again",
        )
    own = [effect for effect in effects() if isinstance(effect, PortEffect) and len(effect.domains) == 1]
    found = []
    for port in system.ports:
        if any(effect.suits(system, port) for effect in own):
            continue
        key, what = ("position", "its level") if port.domain == "balance" else ("velocity", "or position")
        named = ", ".join(port.coordinates) or "no state"
        found.append(
            f"ports.{port.name}: an effort in {port.unit} at {named}: no law of its domain ({port.domain}) "
            f"can act there, only constant and general laws were tried: name a {key} ({what})"
        )
    return tuple(found)


def _of_packages(families: set[str]) -> Iterator[Effect]:
    for name, effect in additions(GROUP, "law", "family"):
        if effect.family in families:
            raise BadInput(f"{name}: the family {effect.family} is taken; rename it")
        yield effect


def _makes_one(kind: type[Effect]) -> bool:
    """Whether a class is an effect by itself: neither a base of others, nor made of what a user gives."""
    is_base = inspect.isabstract(kind) or kind.__name__.startswith("_")
    return not is_base and not inspect.signature(kind).parameters


def _below(kind: type[Any]) -> Iterator[type[Any]]:
    for below in kind.__subclasses__():
        yield below
        yield from _below(below)
