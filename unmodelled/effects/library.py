"""Library of all effects: every class in the files of this package that is not abstract."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from functools import cache
from typing import Any

from unmodelled import effects as package
from unmodelled.effects.effect import Effect


@cache
def effects() -> tuple[Effect, ...]:
    """Return one object of each effect, the simplest first.

    Examples:
        >>> [effect.family for effect in effects()][:2]
        ['actuator_gain', 'actuator_offset']
    """
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    kinds = dict.fromkeys(_below(Effect))  # a class with two bases comes twice
    ours = (kind for kind in kinds if kind.__module__.startswith(f"{package.__name__}."))
    found = [kind() for kind in ours if not inspect.isabstract(kind)]
    return tuple(sorted(found, key=lambda effect: (effect.complexity, effect.family, effect.variant)))


def _below(kind: type[Any]) -> Iterator[type[Any]]:
    for below in kind.__subclasses__():
        yield below
        yield from _below(below)
