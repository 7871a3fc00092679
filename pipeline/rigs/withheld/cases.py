"""A case: a machine, its planted effects, their size, and the seed of all random choices."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.rigs.withheld.effects.effect import Effect, Only, Plan, Plantable, PortEffect
from pipeline.rigs.withheld.machine import Machine
from pipeline.rigs.withheld.machines import EVERY
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput

GROUP = "group"
_EVERYTHING = 0.6  # share of the campaigns that log all outputs


@dataclass(frozen=True)
class Planted:
    """One planted effect."""

    family: str  # as the machine offers it
    channel: str  # as the machine offers it
    #: Of the operating point, at one level of which the effect acts, or "group"; None: acts in all runs
    factor: str | None = None
    at: float | str | None = None  # level of the factor, or name of the group


@dataclass(frozen=True)
class Case:
    """Effects on a machine."""

    system: str  # name of the machine
    effects: tuple[Planted, ...]
    level: float  # size of the effects relative to their typical size
    seed: int  # of all other choices

    def __post_init__(self) -> None:
        for planted in self.effects:
            self.offered(planted)
        if not self.level >= 0.0:
            raise BadInput(f"level: must not be negative, got {self.level}")

    @classmethod
    def of(cls, truth: Mapping[str, Any]) -> "Case":
        """Return the case of a truth.json that `campaign.write` wrote."""
        planted = (
            Planted(row["family"], row["channel"], row.get("factor"), row.get("level"))
            for row in truth["effects"]
        )
        return cls(truth["system"], tuple(planted), truth["level"], truth["seed"])

    @property
    def machine(self) -> Machine:
        """Machine without planted effects."""
        for machine in EVERY:
            if machine.name == self.system:
                return machine
        names = ", ".join(machine.name for machine in EVERY)
        raise BadInput(f"system: {self.system!r} is not one of {names}")

    def offered(self, planted: Planted) -> Plantable:
        """Return the machine's entry of a planted effect."""
        for one in self.machine.plantable:
            if (one.family, one.channel) == (planted.family, planted.channel):
                return one
        raise BadInput(f"effects: {self.system} has no {planted.family} at {planted.channel}")

    @property
    def logged(self) -> tuple[str, ...]:
        """Names of the logged outputs: all if a sensor has a planted effect, otherwise a random choice."""
        faulty = any(planted.channel.startswith("sensor:") for planted in self.effects)
        everything = faulty or np.random.default_rng([self.seed, 4]).uniform() < _EVERYTHING
        sensors = (sensor.output for sensor in self.machine.sensors)
        return tuple(name for name in sensors if everything or name not in self.machine.optional)

    def plan(self) -> Plan:
        """Return the plan of the runs; a logger without some of the outputs has a short sampling period."""
        return self.planned(None, whole=len(self.logged) == len(self.machine.sensors))

    def planned(self, runs: int | None, whole: bool) -> Plan:
        """Return the plan of the runs."""
        machine, rng = self.machine, np.random.default_rng([self.seed, 0])
        period = float(rng.choice(machine.periods)) if whole else min(machine.periods)
        runs = int(rng.choice(machine.runs)) if runs is None else runs
        # steps of about a quarter of a millisecond, an even number of them
        substeps = 2 * max(1, round(period / 5e-4))
        return Plan(
            period=period,
            samples=round(machine.duration / period),
            substeps=substeps,
            hold=float(rng.choice([0.0, 0.5, 1.0])),
            conditions=_conditions(machine, runs),
            groups=tuple(machine.groups[i % len(machine.groups)] for i in range(runs) if machine.groups),
            begin=1.25 * machine.duration * np.arange(runs, dtype=np.float64),
        )

    def size(self, rng: np.random.Generator) -> float:
        """Draw the size of an effect, in typical sizes."""
        return self.level * float(rng.uniform(0.8, 1.25))

    def built(self, plan: Plan) -> list[tuple[str, Effect]]:
        """Return channel and effect of every planted effect: new objects, because effects have a memory."""
        found = []
        for k, planted in enumerate(self.effects):
            rng = np.random.default_rng([self.seed, 1, k])
            effect = self.offered(planted).make(max(self.size(rng), 1e-9), plan, rng)
            if planted.factor is not None:
                assert isinstance(effect, PortEffect)
                effect = Only(effect, _where(plan, planted))
            found.append((planted.channel, effect))
        return found


def _conditions(machine: Machine, runs: int) -> dict[str, Array]:
    """A factorial of the factors' levels, again and again."""
    columns, every = {}, 1
    for factor, levels in machine.factors.items():
        columns[factor] = np.array([levels[i // every % len(levels)] for i in range(runs)])
        every *= len(levels)
    return columns


def _where(plan: Plan, planted: Planted) -> Array:
    if planted.factor == GROUP:
        return np.array([float(group == planted.at) for group in plan.groups])
    return np.asarray(plan.conditions[str(planted.factor)] == planted.at, np.float64)
