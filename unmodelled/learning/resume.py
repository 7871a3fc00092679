"""Keep the state of a training on disk, so that a training that was killed continues to the same result."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import torch

from unmodelled.base.errors import BadInput
from unmodelled.base.markers import ON_ITS_WAY
from unmodelled.learning.checkpoint import read_checkpoint, write_checkpoint
from unmodelled.learning.windows import Problem, Progress, Training

_ARRAYS = ("p", "xi", "weights", "moments_p", "moments_W", "nodes")


def checkpoint_beside(out: Path) -> Path:
    """Return the file that keeps the state of a training until its result is written.

    Examples:
        >>> checkpoint_beside(Path("fits/arm")).as_posix()
        'fits/.arm.checkpoint'
    """
    name = ON_ITS_WAY.sub(r"\1", out.name)
    return out.with_name(f".{name}.checkpoint")


def identity(problem: Problem, windows: Training) -> str:
    """Return a digest of everything that decides the result of a training."""
    model, data = problem.model, problem.data
    digest = hashlib.sha256()
    for array in (data.x, data.u, data.c, data.offsets, problem.bounds, problem.penalties, *problem.runs):
        digest.update(np.ascontiguousarray(array).tobytes())
    for tensor in model.state_dict().values():
        digest.update(tensor.detach().cpu().numpy().tobytes())
    structure = (model.structure.system.closed, model.structure.networks, model.structure.trainable)
    digest.update(repr((windows, problem.how, problem.seed, structure)).encode())
    return digest.hexdigest()


def save_progress(path: Path, stack: list[Progress], name: str) -> None:
    """Write the state of a training."""
    state = {}
    for m, progress in enumerate(stack):
        state[str(m)] = {key: torch.from_numpy(getattr(progress, key).copy()) for key in _ARRAYS} | {
            "history": torch.from_numpy(np.array(progress.history)),
            "numbers": [progress.epoch, progress.batches, int(progress.diverged)],
            "losses": list(progress.losses),
            "seconds": list(progress.seconds),
        }
    write_checkpoint(path, {"class": "Progress", "state": state, "about": {"identity": name}})


def load_progress(path: Path, name: str) -> list[Progress] | None:
    """Read the state that `save_progress` wrote of the same training."""
    if not path.exists():
        return None
    try:
        content = read_checkpoint(path)
        if content["class"] != "Progress" or content["about"]["identity"] != name:
            return None
        return [_progress(content["state"][str(m)]) for m in range(len(content["state"]))]
    except (BadInput, KeyError, TypeError, ValueError, AttributeError):
        return None  # half a checkpoint is none


def _progress(state: dict[str, Any]) -> Progress:
    epoch, batches, diverged = state["numbers"]
    arrays = {key: state[key].numpy().copy() for key in _ARRAYS}
    return Progress(
        **arrays,
        epoch=epoch,
        batches=batches,
        losses=state["losses"],
        history=list(state["history"].numpy()),
        seconds=state["seconds"],
        diverged=bool(diverged),
    )
