"""The columns that may be moving positions, each in the experiment in which it moves most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.drafting.chains import chained
from unmodelled.drafting.channels import slope
from unmodelled.drafting.columns import Signal
from unmodelled.drafting.names import is_measured

#: Sizes of noise that a motion is beyond.
NOISE = 20.0
#: Correlation with the slope of a position from which on a column without a name is its speed.
UNNAMED = 0.95


@dataclass(frozen=True, eq=False)
class Home:
    """A position in the experiment in which it moves most, and its speed if only the values tell it."""

    position: Signal
    signals: Sequence[Signal]
    velocity: Signal | None

    @property
    def motion(self) -> float:
        """Return the range of the position."""
        return float(np.ptp(self.position.values))

    def moves(self, least: float) -> bool:
        """Return whether it moves by more than a least range and by far more than its noise."""
        noise = float(np.std(np.diff(self.position.values, 2))) / np.sqrt(6.0)
        return bool(self.motion > max(least, NOISE * noise))


def unnamed_pairs(signals: Sequence[Signal]) -> dict[Signal, Signal]:
    """Return positions without a telling name, by a column that is their slope."""
    found: dict[Signal, Signal] = {}
    unnamed = [signal for signal in signals if signal.role is None]
    for position in (signal for signal in unnamed if Home(signal, signals, None).moves(0.0)):
        others = [other for other in unnamed if other is not position]
        rated = [(abs(slope(position, other).correlation), other) for other in others]
        best, velocity = max(rated, key=lambda pair: pair[0], default=(0.0, position))
        if best > UNNAMED and velocity not in found:
            found[position] = velocity
    return {position: velocity for position, velocity in found.items() if position not in found.values()}


def distinct(homes: Sequence[Home]) -> list[Home]:
    """Return positions without copies, such as filtered ones; the one that is called measured stays."""
    kept: list[Home] = []
    for home in sorted(homes, key=lambda each: not is_measured(each.position.address)):
        here = {signal.address: signal for signal in home.signals}
        others = [here[other.position.address] for other in kept if other.position.address in here]
        if not any(chained(home.position, other, home.signals) for other in others):
            kept.append(home)
    return [home for home in homes if home in kept]
