"""Drawing cases with measurement chains: nothing planted, one effect, two, more, and effects of no family."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from pipeline.rigs.withheld.cases import Case
from pipeline.rigs.withheld.chain.case import MeasuredCase
from pipeline.rigs.withheld.drawing import LEVELS, Effects, cases, named, of_families
from pipeline.rigs.withheld.effects.effect import Plantable
from pipeline.rigs.withheld.machine import Machine
from pipeline.rigs.withheld.machines import BALANCES, FURTHER, MACHINES
from unmodelled.base.errors import BadInput

#: Number of cases, seed and machines -> at least so many cases.
Draw = Callable[[int, int, Sequence[Machine]], list[MeasuredCase]]


def measured_cases(kind: str, count: int, seed: int) -> list[MeasuredCase]:
    """Return cases of a kind; the first of them are a fair sample of machines and families."""
    kinds = {name: (draw, MACHINES) for name, draw in KINDS.items()}
    kinds |= {f"further_{name}": (draw, FURTHER) for name, draw in KINDS.items()}
    kinds |= {"balance": (_of("single"), BALANCES), "balance_null": (_of("null"), BALANCES)}
    if kind not in kinds:
        raise BadInput(f"kind: {kind!r} is not one of {', '.join(kinds)}")
    draw, machines = kinds[kind]
    found = draw(count, seed, machines)
    if not 1 <= count <= len(found):
        raise BadInput(f"counts.{kind}: must be 1 to {len(found)}, got {count}")
    return found[:count]


def _of(kind: str) -> Draw:
    """The cases of a kind without a chain, with chains."""
    return lambda count, seed, machines: _measured(cases(kind, seed, machines=machines))


def _measured(drawn: list[Case]) -> list[MeasuredCase]:
    return [MeasuredCase(case.system, case.effects, case.level, case.seed) for case in drawn]


def _singles(count: int, seed: int, machines: Sequence[Machine]) -> list[MeasuredCase]:
    """Every family once, then every family a second time, and so on."""
    before: Counter[str] = Counter()
    rounds = []
    for case in _measured(cases("single", seed, machines=machines)):
        (planted,) = case.effects
        rounds.append((before[planted.family], case))
        before[planted.family] += 1
    return [case for _, case in sorted(rounds, key=lambda each: each[0])]


def _on_machines(stream: int, draw: Callable[[Machine, np.random.Generator], Effects]) -> Draw:
    """Cases on every machine in turn, in a drawn order of machines."""

    def drawn(count: int, seed: int, machines: Sequence[Machine]) -> list[MeasuredCase]:
        rng = np.random.default_rng([seed, stream])
        order = rng.permutation(len(machines)).tolist()
        found = []
        for k in range(count):
            machine = machines[order[k % len(order)]]
            level = round(float(np.exp(rng.uniform(*np.log(LEVELS)))), 3)
            found.append(MeasuredCase(machine.name, draw(machine, rng), level, int(rng.integers(2**31))))
        return found

    return drawn


def _some(machine: Machine, rng: np.random.Generator) -> Effects:
    """Three or four effects of different families of which none is like another one."""
    offered, many = of_families(machine), int(rng.integers(3, 5))
    chosen: list[Plantable] = []
    for k in rng.permutation(len(offered)).tolist():
        one = offered[k]
        apart = all(
            one.family != other.family
            and (one.family, one.channel) not in other.alike
            and (other.family, other.channel) not in one.alike
            for other in chosen
        )
        if apart and len(chosen) < many:
            chosen.append(one)
    return tuple(named(one) for one in chosen)


#: Kinds that all machines with and without inertia can have.
KINDS: Mapping[str, Draw] = {
    "null": _on_machines(20, lambda machine, rng: ()),
    "single": _singles,
    "pair": _of("pair"),
    "several": _on_machines(21, _some),
    "outside": _of("outside"),
}
