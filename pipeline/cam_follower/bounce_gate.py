"""A network on top of the bounce simulation: eps = gate (eps_bounce + network), the gate shut in contact."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from torch import Tensor

from pipeline.cam_follower.bounce import BounceParameters, CamMotion, simulate
from pipeline.cam_follower.cam_follower import CamFollower
from unmodelled.base.campaign import Campaign

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Signal = TypeVar("Signal", Array, Tensor)


def gate(contact: Array, offsets: Indices, reach: int = 2) -> Array:
    """How far the simulation leaves contact open, 0 to 1.

    Args:
        contact: (samples,) of a simulation, 0 to 1.
        offsets: (runs + 1,) where the runs begin and end.
        reach: samples before and after a flight at which the gate stays open, because the simulated flight
            may come too early or too late.

    Returns:
        (samples,).
    """
    flight = 1.0 - contact
    runs = [maximum_filter1d(flight[a:b], 2 * reach + 1) for a, b in pairwise(offsets)]
    return np.concatenate(runs)


def gated(opening: Signal, eps_bounce: Signal, network: Signal) -> Signal:
    """Detachment of the hybrid, m: exactly zero in contact, simulation plus network in flight."""
    return opening * (eps_bounce + network)


def with_bounce(
    campaign: Campaign,
    mechanism: CamFollower,
    parameters: BounceParameters,
    members: int = 1,
    spread: float = 0.1,
    reach: int = 2,
) -> Campaign:
    """The campaign with the signals eps_bounce (m), contact and gate (both 0 to 1).

    Raises:
        BadInput: see `CamMotion.of`.
    """
    bounce = simulate(CamMotion.of(campaign, mechanism), parameters, members, spread)
    opening = gate(bounce.contact, campaign.offsets, reach)
    extra = {"eps_bounce": bounce.eps, "contact": bounce.contact, "gate": opening}
    return replace(campaign, signals={**campaign.signals, **extra})


def residual(campaign: Campaign) -> Campaign:
    """The campaign whose eps is what the network of the hybrid has to learn: gate (eps - eps_bounce).

    Args:
        campaign: from `with_bounce`.
    """
    eps, simulated, opening = (
        np.asarray(campaign.signals[name], np.float64) for name in ("eps", "eps_bounce", "gate")
    )
    return replace(campaign, signals={**campaign.signals, "eps": opening * (eps - simulated)})
