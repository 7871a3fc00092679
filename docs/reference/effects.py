"""Write the page on the effects that a diagnosis can name."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from docs.reference.docstrings import ROOT
from docs.reference.markdown import code, table
from unmodelled.effects.added import Added
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.load import load
from unmodelled.effects.scales import Load, Scales, Spread
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system

#: System files; the law of an effect is shown for the first system that has a place for it.
EXAMPLES = (
    "systems/withheld/hoist.yaml",
    "systems/pendulum.yaml",
    "systems/cascaded_tanks/overflow_withheld.yaml",
    "tests/physics/effects/room.yaml",
    "tests/physics/effects/coil.yaml",
    "tests/physics/effects/cell.yaml",
    "systems/coupling.yaml",
    "tests/machines/turntable.yaml",
)
COLUMNS = ("variant", "description", "place", "law", "parameters")
HEAD = """# Effects

This page lists the effects that a model may leave out: {count} laws in {families} families. `diagnose` tries
each law at every suitable place. The laws are shown for a hoist that moves along `x` with the speed `v`, is
driven by `u` and has a port `rail` (`systems/withheld/hoist.yaml`); laws that do not suit the hoist are shown
for a pendulum, for a vessel with the level `h_1`, for a room with the temperature `T`, for a coil with the
current `i`, for a battery with the voltage `v`, or for a coupling with the stiffness `k`. A law without a
variant is the basic form of its family.

Where all of these leave more than noise, `diagnose` writes down a law as the family
`discovered_law`: at a port, a sum of up to three terms in its position and velocity, such as `c_1*x**2*v`.
The terms are a constant, powers of the position up to 5, sines and cosines of an angle up to four times per
turn, and `v`, `x*v`, `x**2*v`, `v*abs(v)` and `v**3`.

"""


def page() -> str:
    """Return one section per family."""
    every = effects()
    families = list(dict.fromkeys(effect.family for effect in every))
    index = ", ".join(f"[{name}](#{name})" for name in families)
    head = HEAD.format(count=len(every), families=len(families)) + index + "\n"
    ordered = sorted(every, key=lambda e: families.index(e.family))
    groups = groupby(ordered, lambda effect: effect.family)
    sections = [f"## {family}\n\n{table(COLUMNS, map(_row, own))}" for family, own in groups]
    return "\n".join([head, *sections])


def _row(effect: Effect) -> tuple[str, ...]:
    added = next(_examples(effect))
    kind = added.place.kind
    text = " ".join((effect.__doc__ or "").split("\n\n")[0].split())
    numbers = ", ".join(f"{code(name)} {_unit(added, name)}" for name in added.reported)
    return code(effect.variant), text, kind, code(added.law), numbers


def _unit(added: Added, name: str) -> str:
    units = {p.name: p.unit for p in added.system.parameters} | dict(added.units)
    return f"({units.get(name, '1')})"


def _examples(effect: Effect) -> Iterator[Added]:
    for file in EXAMPLES:
        system = read_system(ROOT / file)
        for place in effect.places(system)[:1]:
            yield effect.add(system, place, _scales(system))


def _scales(system: System) -> Scales:
    """Return scales of one for all signals. Scales choose starting values only, and these are not shown."""
    one = Spread(-1.0, 1.0, 0.7)
    names = [*(s.name for s in system.states), *(i.name for i in system.inputs), *system.signals]
    ports = {port.name: 1.0 for port in system.ports}
    outputs = {output.name: one for output in system.outputs}
    carried = ((port.name, load(system, port)) for port in system.ports)
    loads = {name: Load(*found, one) for name, found in carried if found is not None}
    return Scales(dict.fromkeys(names, one), outputs, ports, ports, 1e-3, 4.0, loads)
