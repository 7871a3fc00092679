"""Small campaigns of cams that turn as told."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from pipeline.cam_follower.bounce import BounceParameters
from unmodelled.base.campaign import Campaign

Array = NDArray[np.float64]
PERIOD = 0.01

PARAMETERS = BounceParameters(
    restitution=0.7, contact_compliance=6e-6, shaft_compliance=0.02, guide_coulomb=0.5, guide_viscous=10.0
)


def campaign(angles: Sequence[Array], H: float = 0.03, beta: float = np.pi, m: float = 1.0) -> Campaign:
    """One run per angle (rad, at 100 Hz), all of one cam and mass, in contact throughout."""
    lengths = [len(angle) for angle in angles]
    table = pd.DataFrame({"exp": np.arange(1, len(angles) + 1), "H": H, "beta": beta, "m": m})
    signals = {
        "t": np.concatenate([PERIOD * np.arange(n) for n in lengths]),
        "theta": np.concatenate(list(angles)),
        "eps": np.zeros(sum(lengths)),
    }
    return Campaign(table, signals, np.append(0, np.cumsum(lengths)), {})


def turning(speed: float, samples: int = 100) -> Array:
    """Angle, rad, of a cam that takes up `speed` (rad/s) within a fifth of a second."""
    t = PERIOD * np.arange(samples)
    return np.asarray(speed * (t - 0.05 * (1.0 - np.exp(-t / 0.05))))
