"""The experiments of a diagnosis: training experiments and held-out experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from unmodelled.diagnosis.data.input_pace import straight_pace
from unmodelled.diagnosis.data.options import DEFAULT_OPTIONS, Options
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.effects.effect import Effect
from unmodelled.effects.scales import Scales
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System

#: Share of the experiments that `Study.of` holds out, at least one experiment.
HELD_OUT_SHARE = 0.25
#: Longest additional sensor delay that is tried, samples.
LONGEST_DELAY = 64
#: The same in short experiments, as a share of the shortest usual one.
LONGEST_DELAY_SHARE = 0.1


@dataclass(frozen=True, eq=False)
class Study:
    """The inputs of a diagnosis."""

    system: System  # the known physics
    logs: Logs  # of all experiments
    horizon: float  # length of the free-run windows, s
    held_out: tuple[int, ...]  # numbers of the experiments that take no part in fitting or choosing
    options: Options = DEFAULT_OPTIONS
    seed: int = 0  # of the random numbers of models
    laws: tuple[Effect, ...] = ()  # tried beside those of the library
    without: frozenset[str] = frozenset()  # families of the library that are not tried

    @classmethod
    def of(
        cls,
        system: System,
        logs: Logs,
        horizon: float,
        seed: int,
        options: Options = DEFAULT_OPTIONS,
        laws: Sequence[Effect] = (),
    ) -> Study:
        """Return a study that holds out experiments at random, so that the others still have every level."""
        held = held_out(logs.experiments, seed)
        return cls(system, logs, horizon, held, options, seed, tuple(laws))

    @property
    def learned(self) -> tuple[int, ...]:
        """Return the numbers of the training experiments."""
        return tuple(i for i in range(len(self.logs)) if i not in self.held_out)

    @cached_property
    def latest(self) -> float:
        """Return the longest delay of an output, s: known delays and those that candidates may add."""
        known = max((output.delay for output in self.system.outputs), default=0.0)
        shortest, usual = int(np.diff(self.logs.offsets).min()), self.logs.usual_length
        share, late = LONGEST_DELAY_SHARE, known / self.logs.period
        # half of a short experiment stays for its windows
        longest = min(LONGEST_DELAY, int(share * (usual - late)), int(0.5 * (shortest - late)))
        return known + self.logs.period * longest

    @cached_property
    def recording(self) -> Recording:
        """Return the windows of the training experiments; their sensors use no held-out data either."""
        sensors = Sensors(self.logs, self.learned)
        return Recording.of(self.logs, self.horizon, self.learned, self.latest, sensors)

    @cached_property
    def sensors(self) -> Sensors:
        """Return the sensors of all experiments, for models that are fitted already."""
        return Sensors(self.logs)

    @cached_property
    def input_periods(self) -> Mapping[str, float]:
        """Return the sampling period, s, of every input: its own, if it was read from a slower clock."""
        logs = self.logs
        return {name: logs.period * straight_pace(logs, j) for j, name in enumerate(logs.inputs)}

    @cached_property
    def scales(self) -> Scales:
        """Return plausible sizes of states, inputs and efforts along the training experiments."""
        own = prepare(self.system, self.logs.among(self.learned))
        return Scales.measured(self.system, own.period, own.offsets, own.t, own.x, own.u, own.c)


def held_out(experiments: pd.DataFrame, seed: int) -> tuple[int, ...]:
    """Draw held-out experiments; a level of a factor keeps an experiment where that is possible.

    The largest share of a level is left for learning in turn: also of a small level, such as the few
    experiments with a load, one is held out and judges what only they have.
    """
    count = len(experiments)
    many = max(1, round(HELD_OUT_SHARE * count))
    factors = [name for name in experiments.columns if name not in ("id", "file")]
    whole = {name: experiments[name].value_counts().to_dict() for name in factors}
    remaining = {name: dict(counts) for name, counts in whole.items()}
    chosen: list[int] = []
    order = np.random.default_rng([seed, 0]).permutation(count).tolist()
    while len(chosen) < many:
        left = [i for i in order if i not in chosen]
        seen = {i: {n: remaining[n][experiments[n].iloc[i]] for n in factors} for i in left}
        # as few levels as possible are lost; of the others, those of which the largest share is left go first
        best = max(left, key=lambda i: _turn(seen[i], {n: whole[n][experiments[n].iloc[i]] for n in factors}))
        chosen.append(best)
        for name in factors:
            remaining[name][experiments[name].iloc[best]] -= 1
    return tuple(sorted(chosen))


def _turn(seen: Mapping[str, int], whole: Mapping[str, int]) -> tuple[int, float]:
    """How early an experiment is held out: by the lost levels, then by the smallest share left of a level."""
    lost = sum(count == 1 for count in seen.values())
    return -lost, min((seen[n] / whole[n] for n in seen if seen[n] > 1), default=np.inf)
