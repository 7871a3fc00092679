"""New names in a system, and renaming in expressions."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable, Mapping

from unmodelled.systems.model import System
from unmodelled.systems.operations import RESERVED

#: Columns of experiments.csv that no constant may be called.
_COLUMNS = frozenset({"id", "file", "group"})
_LONGEST = 60
_WORD = re.compile(r"(?<![\w.])[A-Za-z]\w*", re.ASCII)


def fresh(system: System, names: Iterable[str], suffix: str) -> dict[str, str]:
    """Return names that a system does not use yet.

    Examples:
        >>> from pathlib import Path
        >>> from unmodelled.systems.reader import read_system
        >>> fresh(read_system(Path("systems/pendulum.yaml")), ["F_c", "b"], "joint")
        {'F_c': 'F_c', 'b': 'b_joint'}
    """
    taken = _taken(system)
    found: dict[str, str] = {}
    for name in names:
        long = f"{name}_{suffix}"[:_LONGEST]
        tries = [name, long, *(f"{long}_{k}" for k in range(2, len(taken) + 4))]
        found[name] = next(n for n in tries if n not in taken and not keyword.iskeyword(n))
        taken.add(found[name])
    return found


def _taken(system: System) -> set[str]:
    lists = (
        *(system.states, system.inputs, system.outputs, system.operating_point, system.parameters),
        *(system.tables, system.events),
    )
    named = {item.name for items in lists for item in items}
    return named | {*system.signals, *(str(e) for e in system.e), *RESERVED, *_COLUMNS}


def renamed(text: str, names: Mapping[str, str]) -> str:
    """Return an expression with other names, all replaced at once.

    Examples:
        >>> renamed("x + exp(-v)", {"x": "v", "v": "x"})
        'v + exp(-x)'
    """
    return _WORD.sub(lambda word: names.get(word.group(), word.group()), text)
