"""The method of Levenberg and Marquardt for windows whose states at the start are unknown too."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.fitting.floor import start_noise
from unmodelled.diagnosis.fitting.normal import Normal
from unmodelled.diagnosis.fitting.residuals import Errors, loss, spread, weights
from unmodelled.diagnosis.fitting.unknowns import Unknowns

Array = NDArray[np.float64]

#: Dampings that are tried at once, relative to the one that was best before.
DAMPINGS = np.array([1.0 / 30.0, 1.0, 30.0])
FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = 1e-3, 1e-9, 1e6
#: A fit has converged when an iteration lowers the loss by less, in all or as a share of it, or moves
#: everything by less than this share of its standard deviation.
ENOUGH, SHARE, CLOSE = 1e-2, 1e-5, 0.03


#: Vectors (sets, entries) and starts (windows, sets, measured states) that are to be simulated.
Asked = tuple[Array, Array]


@dataclass
class Descent:
    """A fit on its way.

    Attributes:
        errors: what is minimised. z: (entries,) what is fitted. moved: (windows, measured states) starts.
        damping: that was best last. loss: there. converged: whether it stopped falling.
    """

    errors: Errors
    z: Array
    moved: Array
    damping: float = FIRST_DAMPING
    loss: float = np.inf
    converged: bool = False

    def normal(self, r: Array) -> tuple[Normal, Array]:
        """Normal equations here, from the errors around, and the errors' robust spread (outputs,)."""
        unknowns, here = self.errors.unknowns, r[:, 0]
        scale = spread(here, unknowns.simulation.recording.counted)
        slopes = self.errors.slopes(self.z, r)
        normal = Normal.of(here, slopes, weights(here, scale), self.moved, unknowns.entry, unknowns.precision)
        return normal, scale

    def iteration(self) -> Generator[Asked, Array, None]:
        """Go to the best of several dampings; none of them being better, try stronger ones.

        Yields what has to be simulated and wants its errors.
        """
        r = yield self.errors.around(self.z, self.moved)
        normal, scale = self.normal(r)
        here = float(self._losses(r[:, :1], self.z[None], self.moved[:, None], scale)[0])
        self.loss = here
        while self.damping <= LARGEST_DAMPING:
            dampings = np.maximum(self.damping * DAMPINGS, LEAST_DAMPING)
            steps = [normal.step(damping, self.z, self.errors.unknowns.bounds) for damping in dampings]
            z = np.stack([there for there, _ in steps])
            moved = self.moved[:, None] + np.stack([moves for _, moves in steps], axis=1)
            losses = self._losses((yield z, moved), z, moved, scale)
            best = int(np.argmin(losses))
            if losses[best] < here:
                near = np.abs(z[best] - self.z) <= CLOSE * np.sqrt(np.diag(normal.covariance()))
                self.z, self.moved, self.loss = z[best], moved[:, best], float(losses[best])
                self.damping = float(dampings[best])
                self.converged = bool(near.all()) or here - self.loss < ENOUGH + SHARE * here
                return
            self.damping = float(dampings[-1] * DAMPINGS[-1])
        self.converged = True

    def _losses(self, r: Array, z: Array, moved: Array, scale: Array) -> Array:
        """(sets,) what is minimised: Huber's loss of the errors, how unlikely starts and vectors are."""
        unlikely = 0.5 * np.sum(moved**2, axis=(0, 2)) + 0.5 * z**2 @ self.errors.unknowns.precision
        return np.asarray(loss(r, scale) + unlikely)


def begun(unknowns: Unknowns, starts: Sequence[Array], substeps: int) -> list[Descent]:
    """Fits that start at vectors (entries,) of the same unknowns, and at the states as they were measured."""
    sigma = start_noise(unknowns.simulation, unknowns.numbers(starts[0][None]))
    errors = Errors(unknowns, sigma, substeps)
    return [Descent(errors, z, np.zeros_like(sigma)) for z in starts]


def advance(descents: Sequence[Descent]) -> None:
    """One iteration of fits that share their errors; what they ask for at a time is simulated together."""
    iterations = [descent.iteration() for descent in descents]
    asked = [(iteration, next(iteration)) for iteration in iterations]
    while asked:
        z, moved = zip(*(what for _, what in asked), strict=True)
        r = descents[0].errors(np.concatenate(z), np.concatenate(moved, axis=1))
        answers = np.split(r, np.cumsum([len(sets) for sets in z])[:-1], axis=1)
        still = []
        for (iteration, _), answer in zip(asked, answers, strict=True):
            with suppress(StopIteration):
                still.append((iteration, iteration.send(answer)))
        asked = still
