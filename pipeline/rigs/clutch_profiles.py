"""The 18 current profiles of the wet-clutch bench (section 3.3.2, figure 3.7)."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_EDGE = 0.002  # duration (s) of a step: the amplifier limits the rate of its current


@dataclass(frozen=True)
class Profiles:
    """A full factorial of fill pulses and ramps.

    Attributes:
        pulse: level of the fill pulse, A. highest: where the ramp ends, A.
        u1: widths of the pulse, s. u2: levels from which the ramp starts, A. u3: slopes of the ramp, A/s.
    """

    pulse: float
    u1: Sequence[float]
    u2: Sequence[float]
    u3: Sequence[float]
    highest: float = 0.6

    @property
    def settings(self) -> list[tuple[float, float, float]]:
        """(u1, u2, u3) of every profile; u3 varies fastest."""
        return list(product(self.u1, self.u2, self.u3))

    def current(self, t: Array, u1: float, u2: float, u3: float) -> Array:
        """Set-point (A) at times `t` (s): nothing before 0, the pulse until u1, then the ramp."""
        top = u1 + (self.highest - u2) / u3
        times = [0.0, _EDGE, u1, u1 + _EDGE, top]
        levels = [0.0, self.pulse, self.pulse, u2 + u3 * _EDGE, self.highest]
        return np.interp(t, times, levels)


MILD = Profiles(0.35, (0.108, 0.172, 0.236), (0.097, 0.121, 0.146), (0.116, 0.231))
SHARP = Profiles(0.45, (0.092, 0.144, 0.2), (0.084, 0.105, 0.126), (0.097, 0.194))
