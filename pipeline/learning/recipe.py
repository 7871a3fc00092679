"""What a file of conf/model/ says: which dynamics, fitted how."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from pipeline.errors import BadInput
from pipeline.files import replacing
from pipeline.models.dataset import Dataset, Indices
from pipeline.models.dynamics import Dynamics


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


def save(model: Dynamics, path: Path, about: dict[str, Any]) -> None:
    """Write the weights of a fitted stack and the facts `about` it (plain types only)."""
    content = {"class": type(model).__name__, "state": model.state_dict(), "about": about}
    with replacing(path) as temporary:
        torch.save(content, temporary)


def load(path: Path, dynamics: Callable[..., Dynamics], dataset: Dataset) -> tuple[Dynamics, dict[str, Any]]:
    """The fitted stack and the facts that `save` wrote; nothing in the file is executed.

    Raises:
        BadInput: when the file is missing, damaged, or belongs to another model.
    """
    try:
        content = torch.load(path, weights_only=True)
        name, state, about = content["class"], content["state"], content["about"]
    except FileNotFoundError:
        raise BadInput(f"{path}: no such file") from None
    except Exception as error:  # torch has no common base for what a damaged file can raise
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise BadInput(f"{path}: not a checkpoint ({reason[:80]})") from None
    model = _like(state, dynamics, dataset)
    if model is None or name != type(model).__name__:
        raise BadInput(f"{path}: is a checkpoint of {name}, another model than the configured one")
    try:
        model.load_state_dict(state)
    except RuntimeError as error:
        reason = str(error).splitlines()[-1].strip()
        raise BadInput(f"{path}: does not fit the configured model ({reason[:120]})") from None
    return model, about


def _like(state: dict[str, Any], dynamics: Callable[..., Dynamics], dataset: Dataset) -> Dynamics | None:
    """A stack as large as the one saved; None if `dynamics` is not made from such a state."""
    try:
        if "network.scale" in state:
            scale = 1.0 / state["network.scale"][:, 0]
            return dynamics(bench=dataset.bench, scale=scale, generator=torch.Generator())
        return dynamics(bench=dataset.bench, batch=len(next(iter(state.values()))))
    except TypeError:
        return None
