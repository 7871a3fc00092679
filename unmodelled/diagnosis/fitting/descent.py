"""The method of Levenberg and Marquardt for fits of free runs, with few derivatives.

A derivative takes a simulation for every unknown and initial state. Between the points of a descent, the
derivatives are therefore updated from the change of the errors (Broyden, A class of methods for solving
nonlinear simultaneous equations, Math. Comp. 19, 1965), and taken anew where these lower the loss no further.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.fitting.floor import start_noise
from unmodelled.diagnosis.fitting.normal_equations import NormalEquations
from unmodelled.diagnosis.fitting.residuals import Errors, loss, spread, weights
from unmodelled.diagnosis.fitting.unknowns import Unknowns

Array = NDArray[np.float64]

#: A fit has converged when an iteration lowers the loss by less, in all or as a share of it. The share is
#: `NEAR_SHARE` where the iteration moves everything by less than `CONVERGED_STEP` of its standard deviation.
#: Such a small step alone is not enough: far from the noise, standard deviations are large.
CONVERGED_LOSS, CONVERGED_SHARE, NEAR_SHARE, CONVERGED_STEP = 1e-2, 1e-5, 1e-3, 0.03
#: Dampings that are tried at once, relative to the one that was best before.
DAMPINGS = np.array([1.0 / 30.0, 1.0, 30.0])
FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = 1e-3, 1e-9, 1e6

#: Vectors (sets, entries) and starts (windows, sets, measured states) that are to be simulated.
Asked = tuple[Array, Array]


@dataclass
class Descent:
    """The state of a fit between iterations.

    Attributes:
        errors: errors that are minimised.
        z: fitted vector, shape (entries,).
        moved: corrections, shape (windows, measured states), of the initial states, in standard deviations.
        share: share of the loss by which an iteration must lower it, default 1e-5.
        damping: best damping of the last iteration.
        loss: loss before the last step.
        converged: whether the loss stopped falling.
        tangent: errors, shape (windows, most steps, outputs), and their derivatives, shape (windows,
            unknowns + measured states, most steps, outputs), at the current point; None where they are
            not taken yet.
    """

    errors: Errors
    z: Array
    moved: Array
    share: float = CONVERGED_SHARE
    damping: float = FIRST_DAMPING
    loss: float = np.inf
    converged: bool = False
    tangent: tuple[Array, Array] | None = None

    def normal(self, here: Array, slopes: Array) -> tuple[NormalEquations, Array]:
        """Return the normal equations at the current point, and the robust spread of its errors.

        Args:
            here: errors, shape (windows, most steps, outputs).
            slopes: their derivatives, shape (windows, unknowns + measured states, most steps, outputs).

        Returns:
            Normal equations, and the spread, shape (outputs,).
        """
        unknowns = self.errors.unknowns
        scale = spread(here, unknowns.simulation.recording.counted)
        weight = weights(here, scale)
        normal = NormalEquations.of(here, slopes, weight, self.moved, unknowns.entry, unknowns.precision)
        return normal, scale

    def iteration(self) -> Generator[Asked, Array, None]:
        """Step to the best of several dampings; where none is better, take derivatives or damp more.

        Yields:
            Vectors, shape (sets, entries), and corrections of initial states, shape (windows, sets, measured
            states), to simulate; their errors are sent back.
        """
        if self.damping > LARGEST_DAMPING:
            self._renew()
        taken = self.tangent is None
        if self.tangent is None:
            r = yield self.errors.around(self.z, self.moved)
            self.tangent = r[:, 0], self.errors.slopes(self.z, r)
        here, slopes = self.tangent
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
                small = self._is_small(before - losses[best], z[best], normal)
                self._move(z[best], moved[:, best], r[:, best])
                self.damping, self.loss = float(dampings[best]), float(losses[best])
                self.converged = small and taken
                if small and not taken:
                    self._renew()
                return
            if not taken:
                self._renew()
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

    def _renew(self) -> None:
        """Take derivatives next; the damping of updated ones says nothing of theirs."""
        self.tangent, self.damping = None, FIRST_DAMPING

    def _move(self, z: Array, moved: Array, r: Array) -> None:
        """Move to a point with errors (windows, most steps, outputs), and update the derivatives."""
        assert self.tangent is not None
        here, slopes = self.tangent
        step = np.concatenate([(z - self.z)[self.errors.unknowns.entry], moved - self.moved], axis=1)
        self.z, self.moved, self.tangent = z, moved, (r, secant(slopes, r - here, step))

    def _losses(self, r: Array, z: Array, moved: Array, scale: Array) -> Array:
        """(sets,) minimised loss: Huber's loss of the errors, and priors of initial states and vectors."""
        unlikely = 0.5 * np.sum(moved**2, axis=(0, 2)) + 0.5 * z**2 @ self.errors.unknowns.precision
        return np.asarray(loss(r, scale) + unlikely)


def secant(slopes: Array, change: Array, step: Array) -> Array:
    """Return the derivatives that are closest to given ones and say how the errors changed along a step.

    Entries of the step count by how much they change the errors. In a window where the derivatives say less
    of the change than they miss, they stay: its errors do not follow a line along the step.

    Args:
        slopes: derivatives, shape (windows, n, samples, outputs).
        change: change of the errors, shape (windows, samples, outputs).
        step: step, shape (windows, n).

    Returns:
        Derivatives, shape (windows, n, samples, outputs).

    Examples:
        A straight line through both points; what the step does not touch stays:

        >>> slopes, change, step = [[[[2.0]], [[1.0]]]], [[[6.0]]], [[2.0, 0.0]]
        >>> secant(np.array(slopes), np.array(change), np.array(step)).ravel().tolist()
        [3.0, 1.0]
    """
    flat = slopes.reshape(*slopes.shape[:2], -1)
    weight = np.einsum("wns,wns->wn", flat, flat) * step
    length = np.sum(weight * step, axis=1, keepdims=True)
    said = step[:, None] @ flat
    missed = change.reshape(len(change), 1, -1) - said
    is_line = np.sum(missed**2, axis=2) <= np.sum(said**2, axis=2)
    factor = np.divide(weight, length, out=np.zeros_like(weight), where=is_line & (length > 0.0))
    return np.asarray(flat + factor[:, :, None] * missed).reshape(slopes.shape)


def begin(
    unknowns: Unknowns,
    starts: Sequence[Array],
    substeps: int,
    share: float = CONVERGED_SHARE,
) -> list[Descent]:
    """Return fits that start at the measured initial states.

    Args:
        unknowns: numbers to fit.
        starts: initial vectors, shape (entries,), one per fit.
        substeps: integration steps per sample.
        share: share of the loss by which an iteration must lower it, default 1e-5.
    """
    sigma = start_noise(unknowns.simulation, unknowns.numbers(starts[0][None]))
    errors = Errors(unknowns, sigma, substeps)
    return [Descent(errors, z, np.zeros_like(sigma), share) for z in starts]


def iterate(descents: Sequence[Descent]) -> None:
    """Iterate fits that share their errors once; their points are simulated together.

    Args:
        descents: fits of the same unknowns.
    """
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
