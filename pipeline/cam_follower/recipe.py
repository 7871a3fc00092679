"""What a file of conf/model/ says: which dynamics, fitted how."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from pipeline.cam_follower.dataset import Dataset, Indices
from pipeline.cam_follower.dynamics import Dynamics
from unmodelled.base.errors import BadInput
from unmodelled.learning.checkpoint import read_checkpoint, restore


@dataclass(frozen=True)
class Recipe:
    """A model and its training.

    Attributes:
        dynamics: constructor of a stack of models.
        fit: trains a stack: `fit(dynamics, dataset, folds, seed) -> Dynamics`.
    """

    dynamics: Callable[..., Dynamics]
    fit: Callable[[Callable[..., Dynamics], Dataset, list[Indices], int], Dynamics]

    def train(self, dataset: Dataset, folds: list[Indices], seed: int) -> Dynamics:
        """A fitted stack, one model per entry of `folds`."""
        return self.fit(self.dynamics, dataset, folds, seed)


def load(path: Path, dynamics: Callable[..., Dynamics], dataset: Dataset) -> tuple[Dynamics, dict[str, Any]]:
    """The fitted stack and the facts that `save` wrote.

    Raises:
        BadInput: when the file is missing, damaged, or belongs to another model.
    """
    content = read_checkpoint(path)
    model = _like(content["state"], dynamics, dataset)
    if model is None:
        raise BadInput(
            f"{path}: is a checkpoint of {content['class']}, another model than the configured one"
        )
    restore(model, content, path)
    return model, content["about"]


def _like(state: dict[str, Any], dynamics: Callable[..., Dynamics], dataset: Dataset) -> Dynamics | None:
    """A stack as large as the one saved; None if `dynamics` is not made from such a state."""
    try:
        if "network.scale" in state:
            scale = 1.0 / state["network.scale"][:, 0]
            return dynamics(bench=dataset.bench, scale=scale, generator=torch.Generator())
        return dynamics(bench=dataset.bench, batch=len(next(iter(state.values()))))
    except (TypeError, ValueError, AttributeError, LookupError, RuntimeError, StopIteration):
        return None
