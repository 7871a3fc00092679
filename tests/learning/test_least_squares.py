"""The linear model has one answer, also where its inputs are collinear."""

from __future__ import annotations

import numpy as np
import torch

from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.least_squares import fit
from pipeline.cam_follower.linear import Linear
from unmodelled.base.campaign import Campaign


def test_collinear_settings_share_their_weight_always_in_the_same_way(small_campaign: Campaign) -> None:
    dataset = Dataset.of(small_campaign, CamFollower())
    # one cam and one mass: neither H, nor beta, nor m tells anything that the constant does not
    fold = np.arange(0, 20, 2)
    found = []
    for size in range(20):
        torch.full((1000 + 777 * size,), float(size))  # other things in memory
        model = fit(lambda bench, batch: Linear(bench, batch), dataset, [fold], seed=size)
        found.append(model.weights.ravel().numpy())
    np.testing.assert_allclose(found, np.broadcast_to(found[0], np.shape(found)), rtol=1e-5)
