"""A case whose campaign is as real ones are: with a measurement chain, and with motions for validation."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pipeline.rigs.withheld.cases import Case
from pipeline.rigs.withheld.chain.drive import ClosedLoop, DriveLag, VaryingFriction, VaryingSupply
from pipeline.rigs.withheld.chain.logger import Clock, CoarseEncoder, DifferencedSpeed, LowPass, PositionOnly
from pipeline.rigs.withheld.chain.motions import Motions, drawn_motions
from pipeline.rigs.withheld.chain.part import Names, Part
from pipeline.rigs.withheld.effects.effect import Plan

RUNS = 6, 16
VALIDATION = 4  # runs
_DELAYS = frozenset(("input_delay", "actuator_lag", "sensor_delay", "sensor_lag"))
_SEVERAL = 0.4, 2.5  # sizes of several effects in a case, beside its level


@dataclass(frozen=True)
class MeasuredCase(Case):
    """A case with the measurement chain that its seed draws: every part with a probability of a half.

    The last `VALIDATION` runs are of other kinds of motion than those of the logs.
    """

    @cached_property
    def runs(self) -> int:
        """Number of runs of the logs."""
        return int(np.random.default_rng([self.seed, 8]).integers(RUNS[0], RUNS[1] + 1))

    @cached_property
    def motions(self) -> Motions:
        """Kinds of motion."""
        return drawn_motions(self.runs, VALIDATION, np.random.default_rng([self.seed, 9]))

    @cached_property
    def chain(self) -> tuple[Part, ...]:
        """Parts of the measurement chain, in the order in which a signal passes them."""
        return tuple(self._drawn(self.runs + VALIDATION, np.random.default_rng([self.seed, 7])))

    def _drawn(self, runs: int, rng: np.random.Generator) -> Iterator[Part]:
        speed = [DifferencedSpeed.drawn(rng), PositionOnly(), None][int(rng.integers(3))]
        if any(planted.channel.startswith("sensor:") for planted in self.effects):
            speed = None  # the faulty sensor is one of its own, and is logged
        parts: tuple[Part, ...] = (
            ClosedLoop.drawn(rng),
            DriveLag.drawn(rng),
            VaryingSupply.drawn(runs, rng),
            VaryingFriction.drawn(runs, rng),
            Clock.drawn(rng),
            CoarseEncoder.drawn(rng),
            LowPass.drawn(rng),
        )
        there = rng.uniform(size=len(parts)) < 0.5
        for part, is_there in zip(parts[:-1], there[:-1], strict=True):
            if is_there and not (self.machine.measured and part.drive()):
                yield part
        if speed is not None:
            yield speed
        if there[-1]:
            yield parts[-1]

    @property
    def doubtful(self) -> tuple[str, ...]:
        """Constants that the user knows badly, beside those of every case; none that resembles an effect."""
        planted = {effect.family for effect in self.effects}
        rng = np.random.default_rng([self.seed, 10])
        drawn = [(name, rng.uniform() < 0.5) for name in self.machine.doubtful]
        return tuple(
            name for name, is_drawn in drawn if is_drawn and not planted & {*self.machine.doubtful[name]}
        )

    @property
    def logged(self) -> tuple[str, ...]:
        positions_only = any(isinstance(part, PositionOnly) for part in self.chain)
        return tuple(s.output for s in self.machine.sensors if not (s.rate and positions_only))

    def plan(self) -> Plan:
        return self.planned(self.runs + VALIDATION, whole=True)

    def size(self, rng: np.random.Generator) -> float:
        if len(self.effects) == 1:
            return super().size(rng)
        return self.level * float(np.exp(rng.uniform(*np.log(_SEVERAL))))

    def alike(self, channel: str, family: str) -> Names:
        """Return families and channels that these logs cannot tell from an effect because of what is logged.

        With one logged output a late input cannot be told from a late output.
        """
        if len(self.logged) > 1 or family not in _DELAYS:
            return ()
        late = ("input_delay", f"actuator:{self.machine.input}"), ("sensor_delay", f"sensor:{self.logged[0]}")
        return tuple(other for other in late if other != (family, channel))
