"""Training twenty networks as one stack against one after the other."""

from __future__ import annotations

from functools import partial

import numpy as np
import torch

from benchmarks.timing import side_by_side
from pipeline.cam_follower import one_step
from pipeline.cam_follower.cam_follower import CamFollower
from pipeline.cam_follower.dataset import Dataset
from pipeline.cam_follower.relu_ode import Hybrid
from tests.conftest import small_campaign

PEER = f"torch {torch.__version__}, a loop over the models"


def run() -> dict[str, float]:
    """f_H2, 32 hidden units, batch 200, 100 steps."""
    campaign = small_campaign.__wrapped__()
    dataset = Dataset.of(campaign, CamFollower())
    folds = [np.arange(20)] * 20
    train = partial(
        one_step.fit, partial(Hybrid, hidden=32), dataset, seed=0, steps=100, learning_rate=0.01, batch=200
    )
    return side_by_side(lambda: train(folds=folds, group=20), lambda: train(folds=folds, group=1), rounds=3)
