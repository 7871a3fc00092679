"""The page on what a diagnosis can name."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from docs.reference.docstrings import ROOT
from docs.reference.markdown import code, table
from unmodelled.effects.added import Added
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.scales import Scales, Spread
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

#: The first of them that an effect suits shows its law.
EXAMPLES = ("systems/withheld/hoist.yaml", "systems/pendulum.yaml")
HEAD = """# Effects

What a model may leave out: {count} laws of {families} families. `diagnose` tries each of them at every place
that it suits. Laws are shown for a hoist that moves along `x` with the speed `v`, is driven by `u` and has a
port `rail` (`systems/withheld/hoist.yaml`), or else for a pendulum. Of laws that data cannot tell apart the
one with the least complexity is named. A law without a variant is the plain form of its family.

"""


def page() -> str:
    """A section a family; families in the order of their simplest member."""
    every = effects()
    families = list(dict.fromkeys(effect.family for effect in every))
    index = ", ".join(f"[{name}](#{name})" for name in families)
    head = HEAD.format(count=len(every), families=len(families)) + index + "\n"
    ordered = sorted(every, key=lambda e: families.index(e.family))
    return "\n".join([head, *(_section(f, list(own)) for f, own in groupby(ordered, lambda e: e.family))])


def _section(family: str, own: list[Effect]) -> str:
    rows = [_row(effect) for effect in own]
    head = ("variant", "what it is", "at", "law", "its numbers", "complexity")
    return f"## {family}\n\n{table(head, rows)}"


def _row(effect: Effect) -> tuple[str, ...]:
    added = next(_examples(effect))
    kind = added.place.kind
    text = " ".join((effect.__doc__ or "").split("\n\n")[0].split())
    numbers = ", ".join(f"{code(name)} {_unit(added, name)}" for name in added.reported)
    return code(effect.variant), text, kind, code(added.law), numbers, f"{effect.complexity:g}"


def _unit(added: Added, name: str) -> str:
    units = {p.name: p.unit for p in added.system.parameters} | dict(added.units)
    return f"({units.get(name, '1')})"


def _examples(effect: Effect) -> Iterator[Added]:
    for file in EXAMPLES:
        system = read_system(ROOT / file)
        for place in effect.places(system)[:1]:
            yield effect.add(system, place, _scales(system))


def _scales(system: System) -> Scales:
    """Everything moves by about one: the sizes choose starting values, which are not shown."""
    one = Spread(-1.0, 1.0, 0.7)
    names = [*(s.name for s in system.states), *(i.name for i in system.inputs), *system.signals]
    ports = {port.name: 1.0 for port in system.ports}
    outputs = {output.name: one for output in system.outputs}
    return Scales(dict.fromkeys(names, one), outputs, ports, ports, 1e-3, 4.0)
