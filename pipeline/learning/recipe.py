"""What a file of conf/model/ says: which dynamics, fitted how."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import nn

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


def save(model: nn.Module, path: Path, about: dict[str, Any]) -> None:
    """Write the weights of a fitted stack and the facts `about` it (plain types only)."""
    write_checkpoint(path, {"class": type(model).__name__, "state": model.state_dict(), "about": about})


def write_checkpoint(path: Path, content: dict[str, Any]) -> None:
    """Write class, state and about.

    Raises:
        BadInput: when the file cannot be written.
    """
    whole = io.BytesIO()  # torch itself does not say of a full disk that it is full
    torch.save(content, whole)
    with replacing(path) as temporary:
        temporary.write_bytes(whole.getbuffer())


def read_checkpoint(path: Path) -> dict[str, Any]:
    """What `write_checkpoint` wrote: class, state, about; nothing in the file is executed.

    Raises:
        BadInput: when the file is missing or damaged.
    """
    try:
        _check_sums(path)
        content = torch.load(path, weights_only=True)
        return {key: content[key] for key in ("class", "state", "about")}
    except FileNotFoundError:
        raise BadInput(f"{path}: no such file") from None
    except Exception as error:  # torch has no common base for what a damaged file can raise
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise BadInput(f"{path}: not a checkpoint ({reason[:80]})") from None


def _check_sums(path: Path) -> None:
    """Torch itself reads a file in which bits have changed, with other weights."""
    with zipfile.ZipFile(path) as archive:
        if damaged := archive.testzip():
            raise zipfile.BadZipFile(f"{damaged} is damaged")


def restore(model: nn.Module, content: dict[str, Any], path: Path) -> None:
    """Put the weights of a checkpoint into `model`.

    Raises:
        BadInput: when they belong to another model.
    """
    if content["class"] != type(model).__name__:
        raise BadInput(
            f"{path}: is a checkpoint of {content['class']}, another model than the configured one"
        )
    try:
        model.load_state_dict(content["state"])
    except (RuntimeError, AttributeError, TypeError) as error:
        reason = str(error).splitlines()[-1].strip()
        raise BadInput(f"{path}: does not fit the configured model ({reason[:120]})") from None


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
