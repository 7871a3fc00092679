"""Train a stack of hybrid models of a system; continue a training that was killed."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.base.progress import Counter
from unmodelled.learning.fit import Fit
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.resume import identity, load_progress, save_progress
from unmodelled.learning.windows import Problem, Progress, Training, finished

#: Time between two checkpoints, s.
INTERVAL = 10.0


def fit(
    problem: Problem,
    training: Training,
    trained_on: Mapping[str, tuple[str, ...]],
    device: str = "cpu",
    checkpoint: Path | None = None,
) -> Fit:
    """Train the stack of `problem` to the end.

    A model whose loss is not finite keeps the weights before that and is reported on standard error; the
    others continue.
    """
    name = identity(problem, training)
    stack = load_progress(checkpoint, name) if checkpoint is not None else None
    if stack is None:
        stack = [Progress.start(problem.model, m) for m in range(len(problem.runs))]
    begin = time.monotonic()
    if device == "cpu":
        _train(training, problem, stack, checkpoint, name)
    else:
        from unmodelled.learning.on_device import train_on

        train_on(device, problem, training, stack)
    repeats = len(stack) // len(trained_on)
    labels = [(fold, repeat) for fold in trained_on for repeat in range(repeats)]
    diverged = tuple(label for label, s in zip(labels, stack, strict=True) if s.diverged)
    for fold, repeat in diverged:
        print(
            f"warning: fold {fold}, repeat {repeat}: diverged, its last finite weights are kept",
            file=sys.stderr,
        )
    return Fit(
        model=finished(problem.model, stack),
        integration=problem.how,
        trained_on=dict(trained_on),
        repeats=repeats,
        seed=problem.seed,
        horizon=training.horizon,
        epochs=training.epochs,
        diverged=diverged,
        seconds=time.monotonic() - begin,
        history=_history(problem, labels, stack),
    )


def start_from(problem: Problem, fitted: Nnap) -> None:
    """Begin the training of a stack where another one ended."""
    model = problem.model
    if (fitted.batch, fitted.weights.shape) != (model.batch, model.weights.shape):
        raise BadInput(
            f"the fit to start from must have {model.batch} models of {model.weights.shape[1]} weights, "
            f"got {fitted.batch} of {fitted.weights.shape[1]}"
        )
    model.load_state_dict(fitted.state_dict())


def _train(
    training: Training, problem: Problem, stack: list[Progress], checkpoint: Path | None, name: str
) -> None:
    total = training.epochs * len(stack)
    last = time.monotonic()
    with Counter(total, f"training {len(stack)} models, epochs") as counter:
        for done in training.train(problem, stack):
            counter.update(done)
            if checkpoint is not None and time.monotonic() - last > INTERVAL:
                save_progress(checkpoint, stack, name)
                last = time.monotonic()
    if checkpoint is not None and checkpoint.exists():  # what follows may fail, on a full disk for instance
        save_progress(checkpoint, stack, name)


def _history(problem: Problem, labels: list[tuple[str, int]], stack: list[Progress]) -> pd.DataFrame:
    names = problem.model.structure.trainable
    tables = []
    for (fold, repeat), s in zip(labels, stack, strict=True):
        values = np.array(s.history).reshape(len(s.losses), len(names))
        table = pd.DataFrame({"fold": fold, "repeat": repeat, "epoch": np.arange(1, len(s.losses) + 1)})
        columns = {name: values[:, k] for k, name in enumerate(names)}
        tables.append(table.assign(loss=s.losses, seconds=s.seconds, **columns))
    return pd.concat(tables, ignore_index=True)
