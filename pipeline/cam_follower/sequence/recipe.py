"""A recurrent network and its training, as a file of conf/model/ describes them: inputs, size, training."""

import hashlib
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import torch

from pipeline.cam_follower.detachment import DetachmentRecipe
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequence.arrays import Sizes
from pipeline.cam_follower.sequence.fits import SUMMARY, Fits, path_of, read_about, read_fits, save_fit
from pipeline.cam_follower.sequence.layout import sizes
from pipeline.cam_follower.sequence.stack import train_stack
from pipeline.cam_follower.sequence.training import Course, Start, Training, standardised, train
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.arrays import Indices
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.files import claim, write_json
from unmodelled.base.progress import Counter


@dataclass(frozen=True)
class SequenceRecipe(DetachmentRecipe):
    """A detachment network and its training (section 5.4.2).

    `fit` writes one file per fold and repeat, and fits.json when all files are complete. Existing fits of the
    same data, settings and seed are kept, so that an interrupted training continues with the next fit; a
    damaged fit or a fit of other features is refused, and nothing is overwritten then. Repeats differ in
    their initial weights and in the order of the runs. On another device than the processor, the repeats of a
    fold are one stack.

    Attributes:
        inputs: names of the features tau and the settings q_s.
        training: settings of the training.
        hidden: size n_s of the LSTM's state; default 32.
        head: number n_eta of hidden units of the ReLU network; default 32.
        dropout: probability that a hidden unit of the ReLU network is ignored; default 0.05.
        samples: number of samples after which a run is cut off; default 200, that is 4000 samples at the 2000
            Hz of the bench.

    Raises:
        BadInput: when a size or the dropout is out of range.
    """

    inputs: SequenceInputs
    training: Training
    hidden: int = 32
    head: int = 32
    dropout: float = 0.05
    samples: int = 200

    def __post_init__(self) -> None:
        if not 0.0 <= self.dropout < 1.0:
            raise BadInput(f"dropout must be at least 0 and less than 1, got {self.dropout}")
        if self.samples < 1 or self.training.batch < 1:
            raise BadInput(
                f"samples and batch must be positive, got {self.samples} and {self.training.batch}"
            )
        sizes(DetachmentNetwork(self.inputs, self.hidden, self.head))

    def fit(
        self,
        campaign: Campaign,
        folds: Mapping[str, Indices],
        repeats: int,
        seed: int,
        out: Path,
        workers: int = 2,
        device: str = "cpu",
    ) -> float:
        tasks = self._tasks(campaign, folds, repeats, seed, out)
        left = [task for task in tasks if not task.done()]
        if left:
            claim(out / SUMMARY)
            (out / SUMMARY).unlink(missing_ok=True)
        if device == "cpu":
            _side_by_side(left, workers)
        else:
            _stacked(left, device)
        about = [read_about(task.path, self.inputs) for task in tasks]
        _warn(about)
        summary = {"folds": list(folds), "repeats": repeats, "seed": seed, **self._summary(about)}
        write_json(out / SUMMARY, summary)
        return float(summary["core_seconds"])

    def _tasks(
        self, campaign: Campaign, folds: Mapping[str, Indices], repeats: int, seed: int, out: Path
    ) -> list["_Task"]:
        """Return one task per fold and repeat; for the arguments see `fit`."""
        sequences = Sequences.of(campaign, self.inputs, self.samples)
        return [
            _Task(self, name, runs, repeat, seed, path_of(out, fold, repeat))
            for fold, (name, runs) in enumerate((n, sequences.of_runs(rows)) for n, rows in folds.items())
            for repeat in range(repeats)
        ]

    def _summary(self, about: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Return inputs and size of the networks, and the course of their training."""
        features, settings = self.inputs.features, self.inputs.settings
        return {
            "features": list(features),
            "settings": list(settings),
            "updates": [fit["updates"] for fit in about],
            "not_converged": [[fit["fold"], fit["repeat"]] for fit in about if not fit["converged"]],
            "parameters": Sizes(len(features), self.hidden, self.head, len(settings)).weights,
            "core_seconds": float(sum(fit["seconds"] for fit in about)),
        }

    def read(self, folder: Path) -> Fits:
        fits = read_fits(folder)
        read_about(path_of(folder, 0, 0), self.inputs)
        if fits.samples != self.samples:
            raise BadInput(f"{folder}: was fitted on {fits.samples} samples of a run, not on {self.samples}")
        return fits


@dataclass(frozen=True)
class _Task:
    """One fit."""

    recipe: SequenceRecipe
    fold: str
    runs: Sequences
    repeat: int
    seed: int
    path: Path

    def done(self) -> bool:
        """Whether the file is there."""
        return self.path.exists() and read_about(self.path, self.recipe.inputs)["identity"] == self.identity()

    def identity(self) -> str:
        """Digest of all that decides the result."""
        digest = hashlib.sha256(repr((self.recipe, self.seed, self.repeat)).encode())
        for array in (self.runs.features, self.runs.settings, self.runs.target, self.runs.lengths):
            digest.update(repr(array.shape).encode() + np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()

    def start(self) -> Start:
        """The network before training; the same for every fold."""
        weights, draws = np.random.SeedSequence([self.seed, self.repeat]).generate_state(2)
        generator = torch.Generator().manual_seed(int(weights))
        recipe = self.recipe
        network = DetachmentNetwork(recipe.inputs, recipe.hidden, recipe.head, recipe.dropout, generator)
        network.scale_to(self.runs)
        return Start(network, standardised(self.runs, network), int(draws))

    def save(self, network: DetachmentNetwork, course: Course, seconds: float) -> None:
        """Write the fit."""
        about = {
            "identity": self.identity(),
            "fold": self.fold,
            "repeat": self.repeat,
            "seed": self.seed,
            "samples": self.recipe.samples,
            "updates": course.updates,
            "converged": course.converged,
            "losses": course.losses,
            "rates": course.rates,
            "seconds": seconds,
        }
        save_fit(self.path, network, about)

    def run(self, stopped: Callable[[], bool]) -> None:
        """Train and save, unless it is stopped."""
        # of this thread: what else the machine does is no time of training
        begin, start = time.thread_time(), self.start()
        course = train(start, self.recipe.training, stopped)
        if not stopped():
            self.save(start.network, course, time.thread_time() - begin)


def _warn(about: Sequence[Mapping[str, Any]]) -> None:
    early = [fit for fit in about if not fit["converged"]]
    if early:
        first = f"fold {early[0]['fold']}, repeat {early[0]['repeat']} after {early[0]['updates']} updates"
        print(f"warning: {len(early)} of {len(about)} fits have not converged, {first}", file=sys.stderr)


def _side_by_side(tasks: list[_Task], workers: int) -> None:
    stop = Event()
    with (
        ThreadPoolExecutor(workers) as pool,
        Counter(len(tasks), f"training {len(tasks)} networks") as counter,
    ):
        jobs = [pool.submit(task.run, stop.is_set) for task in tasks]
        try:
            for done, job in enumerate(as_completed(jobs), start=1):
                job.result()
                counter.update(done)
        finally:
            # after an interruption or a failure the other fits end at once
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)


def _stacked(tasks: list[_Task], device: str) -> None:
    folds = list(dict.fromkeys(task.fold for task in tasks))
    with Counter(len(folds), f"training {len(tasks)} networks on {device}, folds") as counter:
        for done, fold in enumerate(folds, start=1):
            members = [task for task in tasks if task.fold == fold]
            starts, begin = [task.start() for task in members], time.monotonic()
            courses = train_stack(starts, members[0].recipe.training, device)
            seconds = (time.monotonic() - begin) / len(members)
            for task, start, course in zip(members, starts, courses, strict=True):
                task.save(start.network, course, seconds)
            counter.update(done)
