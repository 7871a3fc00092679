"""The experiments of a diagnosis: which of them are learned from, and which are held out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.effects.scales import Scales
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System


@dataclass(frozen=True, eq=False)
class Study:
    """What a diagnosis sees.

    Attributes:
        system: the known physics. logs: all experiments. horizon: of the free-run windows, s.
        held_out: numbers of the experiments that take no part in fitting or choosing.
    """

    system: System
    logs: Logs
    horizon: float
    held_out: tuple[int, ...]
    thresholds: Thresholds = DEFAULT_THRESHOLDS

    @classmethod
    def of(
        cls,
        system: System,
        logs: Logs,
        horizon: float,
        seed: int,
        thresholds: Thresholds = DEFAULT_THRESHOLDS,
    ) -> Study:
        """Hold out a quarter of the experiments by chance, such that the others still show every level."""
        held = held_out(logs.experiments, seed, thresholds)
        return cls(system, logs, horizon, held, thresholds)

    @property
    def learned(self) -> tuple[int, ...]:
        """Numbers of the experiments that models are fitted to."""
        return tuple(i for i in range(len(self.logs)) if i not in self.held_out)

    @cached_property
    def latest(self) -> float:
        """Room for delays of outputs, s: for the known ones, and for more that are looked for."""
        known = max((output.delay for output in self.system.outputs), default=0.0)
        shortest = int(np.diff(self.logs.offsets).min()) - known / self.logs.period
        limits = self.thresholds
        longest = min(limits.longest_delay, int(limits.longest_delay_share * shortest))
        return known + self.logs.period * longest

    @cached_property
    def recording(self) -> Recording:
        """The windows that models are fitted to; held-out experiments say nothing of the sensors either."""
        sensors = Sensors(self.logs, self.learned)
        return Recording.of(self.logs, self.horizon, self.learned, self.latest, sensors)

    @cached_property
    def sensors(self) -> Sensors:
        """Of all experiments, for models that are fitted already."""
        return Sensors(self.logs)

    @cached_property
    def scales(self) -> Scales:
        """Sizes along the experiments that are learned from."""
        own = prepare(self.system, self.logs.among(self.learned))
        return Scales.measured(self.system, own.period, own.offsets, own.t, own.x, own.u, own.c)


def held_out(
    experiments: pd.DataFrame, seed: int, thresholds: Thresholds = DEFAULT_THRESHOLDS
) -> tuple[int, ...]:
    """Rows of the table of experiments; no level of a factor loses its only one if that can be helped."""
    count = len(experiments)
    many = max(1, round(thresholds.held_out_share * count))
    factors = [name for name in experiments.columns if name not in ("id", "file")]
    remaining = {name: experiments[name].value_counts().to_dict() for name in factors}
    chosen: list[int] = []
    order = np.random.default_rng([seed, 0]).permutation(count).tolist()
    while len(chosen) < many:
        left = [i for i in order if i not in chosen]
        seen = {i: [remaining[n][experiments[n].iloc[i]] for n in factors] for i in left}
        # as few levels as possible are lost; of the others, the most seen go first
        best = max(left, key=lambda i: (-seen[i].count(1), min((n for n in seen[i] if n > 1), default=count)))
        chosen.append(best)
        for name in factors:
            remaining[name][experiments[name].iloc[best]] -= 1
    return tuple(sorted(chosen))
