"""A case whose campaign is as real ones are: with a measurement chain, and with motions for validation."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pipeline.rigs.withheld.cases import Case
from pipeline.rigs.withheld.chain.drive import ClosedLoop, DriveLag, VaryingFriction, VaryingSupply
from pipeline.rigs.withheld.chain.logger import Clock, CoarseEncoder, DifferencedSpeed, LowPass, PositionOnly
from pipeline.rigs.withheld.chain.part import Names, Part
from pipeline.rigs.withheld.effects.effect import Plan
from pipeline.rigs.withheld.experiments import KINDS as SMOOTH
from pipeline.rigs.withheld.experiments import TURN, Kind, smooth
from unmodelled.base.arrays import Array

RUNS = 6, 16
VALIDATION = 4  # runs
_DELAYS = frozenset(("input_delay", "actuator_lag", "sensor_delay", "sensor_lag"))
_SEVERAL = 0.4, 2.5  # sizes of several effects in a case, beside its level
LEARNED = 3  # kinds of motion in the logs
LINES = 12  # frequencies of a multisine


def _multisine(t: Array, band: float, rng: np.random.Generator) -> Array:
    """Return a sum of equally strong harmonics of the run with random phases."""
    frequencies = np.linspace(band / LINES, band, LINES)
    phases = rng.uniform(0.0, TURN, LINES)
    total = np.sum(np.sin(TURN * np.multiply.outer(t, frequencies) + phases), axis=-1)
    return np.asarray(total / np.max(np.abs(total)))


def _steps(t: Array, band: float, rng: np.random.Generator) -> Array:
    """Return steps between random levels at random times."""
    count, rise = max(4, round(1.5 * t[-1])), 0.15 / band
    begin = (np.arange(count) + rng.uniform(0.0, 0.6, count)) * t[-1] / count
    jumps = np.diff(rng.uniform(-1.0, 1.0, count), prepend=0.0)
    return sum((j * smooth((t - b) / rise) for j, b in zip(jumps, begin, strict=True)), np.zeros_like(t))


#: Kinds of motion by name.
KINDS: Mapping[str, Kind] = {**SMOOTH, "multisine": _multisine, "steps": _steps}


class Motions(NamedTuple):
    """Names of the kind of every run, in `KINDS`: those of the logs, then those of the validation."""

    learned: tuple[str, ...]
    validation: tuple[str, ...]

    @property
    def kinds(self) -> Sequence[Kind]:
        """The kinds of all runs."""
        return [KINDS[name] for name in (*self.learned, *self.validation)]


def drawn_motions(learned: int, validation: int, rng: np.random.Generator) -> Motions:
    """Draw kinds for `learned` runs, and others for `validation` runs."""
    order = [list(KINDS)[k] for k in rng.permutation(len(KINDS)).tolist()]
    mine, others = order[:LEARNED], order[LEARNED:]
    return Motions(
        tuple(mine[i % len(mine)] for i in range(learned)),
        tuple(others[i % len(others)] for i in range(validation)),
    )


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
