"""The difference between the scores of two candidates, and whether it is more than chance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from unmodelled.base.arrays import Array

#: Parts up to which all changes of signs are counted; of more parts, so many random ones.
EXACT, DRAWN = 12, 4096


@dataclass(frozen=True)
class Comparison:
    """The difference between the scores of two candidates over left-out parts."""

    mean: float  # difference, nats; positive if the second candidate predicts better
    error: float  # standard error of the mean
    #: Probability of so large a mean if the sign of every difference were chance (sign-flip test), which asks
    #: for no normal distribution: a law that acts in some parts only has few large gains.
    chance: float

    @classmethod
    def of(cls, differences: Array) -> Comparison:
        """Compare paired scores; differences (parts,)."""
        count, total = len(differences), float(differences.sum())
        error = float(differences.std(ddof=1) / np.sqrt(count)) if count > 1 else np.inf
        flipped = signs(count) @ differences
        chance = float(np.mean(flipped >= total - 1e-9 * np.abs(differences).sum()))
        return cls(total / count, error, chance)

    def is_significant(self, level: float) -> bool:
        """Return whether the difference is positive beyond chance."""
        return self.mean > 0.0 and self.chance <= 1.0 - level


@cache
def signs(parts: int) -> Array:
    """Return signs (changes, parts) of differences as chance may give them."""
    if parts <= EXACT:
        return np.array(list(product((1.0, -1.0), repeat=parts)))
    drawn = np.random.default_rng(0).choice([1.0, -1.0], (DRAWN, parts))
    return np.vstack([np.ones(parts), drawn])
