"""The method of Levenberg and Marquardt for fits of free runs."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.fitting.floor import start_spread
from unmodelled.diagnosis.fitting.normal_equations import NormalEquations
from unmodelled.diagnosis.fitting.residuals import Errors, loss, spread, weights
from unmodelled.diagnosis.fitting.unknowns import Unknowns

#: A fit has converged when an iteration lowers the loss by less, in all or as a share of it. The share is
#: `NEAR_SHARE` where the iteration moves everything by less than `CONVERGED_STEP` of its standard deviation.
#: Such a small step alone is not enough: far from the noise, standard deviations are large.
CONVERGED_LOSS, CONVERGED_SHARE, NEAR_SHARE, CONVERGED_STEP = 1e-2, 1e-5, 1e-3, 0.03
#: Dampings that are tried at once, relative to the one that was best before.
DAMPINGS = np.array([1.0 / 30.0, 1.0, 30.0])
FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = 1e-3, 1e-9, 1e6

#: Vectors (sets, entries) and starts (windows, sets, free states) that are to be simulated.
Asked = tuple[Array, Array]


@dataclass
class Descent:
    """The state of a fit between iterations."""

    errors: Errors
    z: Array  # fitted vector, (entries,)
    moved: Array  # corrections of the initial states, (windows, free states), in standard deviations
    share: float = CONVERGED_SHARE  # of the loss by which an iteration must lower it
    damping: float = FIRST_DAMPING  # best one of the last iteration
    loss: float = np.inf  # before the last step
    converged: bool = False  # whether the loss stopped falling

    def normal(self, here: Array, slopes: Array) -> tuple[NormalEquations, Array]:
        """Return the normal equations at this point, and the robust spread (outputs,) of its errors."""
        unknowns = self.errors.unknowns
        scale = spread(here, unknowns.simulation.recording.counted)
        weight = weights(here, scale)
        normal = NormalEquations.of(here, slopes, weight, self.moved, unknowns.entry, unknowns.precision)
        return normal, scale

    def iteration(self) -> Generator[Asked, Array, None]:
        """Step to the best of several dampings; where none is better, try stronger ones.

        Yields `Asked` points, and is sent their errors (windows, sets, most steps, outputs).
        """
        r = yield self.errors.around(self.z, self.moved)
        here, slopes = r[:, 0], self.errors.slopes(self.z, r)
        normal, scale = self.normal(here, slopes)
        before = float(self._losses(here[:, None], self.z[None], self.moved[:, None], scale)[0])
        self.loss = before
        while self.damping <= LARGEST_DAMPING:
            dampings = np.maximum(self.damping * DAMPINGS, LEAST_DAMPING)
            steps = [normal.step(damping, self.z, self.errors.unknowns.bounds) for damping in dampings]
            z = np.stack([there for there, _ in steps])
            moved = self.moved[:, None] + np.stack([moves for _, moves in steps], axis=1)
            r = yield z, moved
            losses = self._losses(r, z, moved, scale)
            best = int(np.argmin(losses))
            if losses[best] < before:
                self.converged = self._is_small(before - losses[best], z[best], normal)
                self.z, self.moved, self.loss = z[best], moved[:, best], float(losses[best])
                self.damping = float(dampings[best])
                return
            self.damping = float(dampings[-1] * DAMPINGS[-1])
        self.converged = True

    def _is_small(self, fall: float, z: Array, normal: NormalEquations) -> bool:
        """Whether a step to a vector lowers the loss by little."""
        if fall >= CONVERGED_LOSS + max(NEAR_SHARE, self.share) * self.loss:
            return False
        near = np.abs(z - self.z) <= CONVERGED_STEP * np.sqrt(np.diag(normal.covariance()))
        share = max(NEAR_SHARE if near.all() else 0.0, self.share)
        return bool(fall < CONVERGED_LOSS + share * self.loss)

    def _losses(self, r: Array, z: Array, moved: Array, scale: Array) -> Array:
        """(sets,) minimised loss: Huber's loss of the errors, and priors of initial states and vectors."""
        unlikely = 0.5 * np.sum(moved**2, axis=(0, 2)) + 0.5 * z**2 @ self.errors.unknowns.precision
        return np.asarray(loss(r, scale) + unlikely)


def begin(
    unknowns: Unknowns,
    starts: Sequence[Array],
    substeps: int,
    share: float = CONVERGED_SHARE,
) -> list[Descent]:
    """Return fits that start at the expected initial states, from vectors (entries,)."""
    sigma = start_spread(unknowns.simulation, unknowns.numbers(starts[0][None]), substeps)
    errors = Errors(unknowns, sigma, substeps)
    return [Descent(errors, z, np.zeros_like(sigma), share) for z in starts]


def iterate(descents: Sequence[Descent]) -> None:
    """Iterate fits that share their errors once; their points are simulated together."""
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
