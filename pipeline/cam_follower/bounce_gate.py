"""Combine the bounce simulation with a network: eps = gate * (eps_bounce + network), gate = 0 in contact."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
from scipy.ndimage import maximum_filter1d
from torch import Tensor

from pipeline.arrays import Array, Indices
from pipeline.cam_follower.bounce import BounceParameters, CamMotion, simulate
from pipeline.cam_follower.cam_follower import CamFollower
from unmodelled.base.campaign import Campaign

Signal = TypeVar("Signal", Array, Tensor)


def gate(contact: Array, offsets: Indices, reach: int = 2) -> Array:
    """Return the factor, 0 to 1, that sets the prediction to zero in simulated contact.

    Takes contact (samples,), offsets (runs + 1,); gives (samples,).
    """
    flight = 1.0 - contact
    runs = [maximum_filter1d(flight[a:b], 2 * reach + 1) for a, b in pairwise(offsets)]
    return np.concatenate(runs)


def gated(opening: Signal, eps_bounce: Signal, network: Signal) -> Signal:
    """Return the detachment of the hybrid model, m: zero in contact, simulation plus network in flight.

    Takes eps_bounce in m, network in m; gives (same shape).
    """
    return opening * (eps_bounce + network)


def with_bounce(
    campaign: Campaign,
    mechanism: CamFollower,
    parameters: BounceParameters,
    members: int = 1,
    spread: float = 0.1,
    reach: int = 2,
) -> Campaign:
    """Add the signals eps_bounce (m), contact and gate (both 0 to 1) to a campaign."""
    bounce = simulate(CamMotion.of(campaign, mechanism), parameters, members, spread)
    opening = gate(bounce.contact, campaign.offsets, reach)
    extra = {"eps_bounce": bounce.eps, "contact": bounce.contact, "gate": opening}
    return replace(campaign, signals={**campaign.signals, **extra})


def residual(campaign: Campaign) -> Campaign:
    """Replace the signal eps by the training target of the hybrid's network: gate * (eps - eps_bounce)."""
    eps, simulated, opening = (
        np.asarray(campaign.signals[name], np.float64) for name in ("eps", "eps_bounce", "gate")
    )
    return replace(campaign, signals={**campaign.signals, "eps": opening * (eps - simulated)})
