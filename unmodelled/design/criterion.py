"""Value of experiments: the distance of models, or the intervals of numbers after the experiment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unmodelled.design.limits import Limits
from unmodelled.design.rivals import Rival

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Value:
    """Value of simulated experiments."""

    excess: Array  # (designs,), largest excess of a travel limit, as a share of its width; inf: diverges
    #: (designs, alternatives), from the named model, standard deviations; nan beyond the limits.
    distances: Array
    #: (designs, numbers), standard deviations of the named model's numbers, SI; nan beyond limits.
    after: Array


@dataclass(frozen=True, eq=False)
class Criterion:
    """Criterion of an experiment.

    The distance of two models is the T-criterion (Atkinson and Fedorov 1975): the weighted squared gap of
    their outputs, minimised over the numbers of both within their uncertainty. With one model, the numbers'
    covariance after the experiment counts (A-optimality). An output's weight is 1/(noise² + samples spread²):
    noise differs from sample to sample; what experiments of one machine differ by may last a whole run, and
    does not average out.
    """

    rivals: Sequence[Rival]  # the named model, then its alternatives
    limits: Limits
    noise: Array  # (outputs,), standard deviations of the sensor noise, in units of the outputs
    spread: Array  # (outputs,), error of the named model over whole runs beyond the noise, in these units
    numbers: Sequence[str]  # those whose relative intervals count if there are no alternatives

    def __call__(self, u: Array) -> Value:
        """Simulate experiments (designs, samples, inputs), SI, and compute their value."""
        excess = np.max(
            [self.limits.excess(r.runs(u, self.limits, False)[1][:, 0]) for r in self.rivals], axis=0
        )
        inside = np.flatnonzero(excess == 0.0)
        named = self.rivals[0]
        distances = np.full((len(u), len(self.rivals) - 1), np.nan)
        after = np.full((len(u), len(named.values)), np.nan)
        if len(inside):
            y, slopes = self._outputs(named, u[inside])
            deviation = named.root @ _root_after(slopes)
            after[inside] = np.linalg.norm(deviation, axis=-1)
            for k, other in enumerate(self.rivals[1:]):
                distances[inside, k] = distance((y, slopes), self._outputs(other, u[inside]))
        return Value(excess, distances, after)

    def scores(self, found: Value) -> Array:
        """Return what a search maximises (designs,): positive within the limits, below -1 beyond them."""
        beyond = -1.0 - np.minimum(found.excess, 1e6)
        if len(self.rivals) > 1:
            # ties of models that no experiment within the limits tells apart are left to the others
            value = found.distances.min(axis=1) + 1e-3 * found.distances.mean(axis=1)
        else:
            before, after = (self.relative(s) for s in (self.before[None], found.after))
            value = np.log(before / after)
        return np.asarray(np.where(found.excess > 0.0, beyond, value))

    @property
    def before(self) -> Array:
        """Return the standard deviations of the named model's numbers from the logs, shape (numbers,), SI."""
        return np.asarray(np.linalg.norm(self.rivals[0].root, axis=1))

    def relative(self, deviation: Array) -> Array:
        """Return the rms (designs,) of relative standard deviations (designs, numbers) of counted numbers."""
        named = self.rivals[0]
        rows = [list(named.values).index(name) for name in self.numbers]
        scales = [named.fitted.hypothesis.unknowns[k].scale for k in rows]
        size = np.array([abs(named.values[n]) or s for n, s in zip(self.numbers, scales, strict=True)])
        return np.asarray(np.sqrt(np.mean((deviation[:, rows] / size) ** 2, axis=1)))

    @property
    def unit(self) -> Array:
        """Return the standard deviation of the outputs, shape (outputs,), that an experiment is judged by."""
        return np.sqrt(self.noise**2 + self.limits.samples * self.spread**2)

    def _outputs(self, rival: Rival, u: Array) -> tuple[Array, Array]:
        return weighted(rival, rival.runs(u, self.limits, True)[0] / self.unit)


def weighted(rival: Rival, y: Array) -> tuple[Array, Array]:
    """Return predictions (designs, values) and their slopes (designs, numbers, values) by the numbers.

    Takes y (designs, sets, samples, outputs).
    """
    flat = np.nan_to_num(y.reshape(*y.shape[:2], -1), posinf=0.0, neginf=0.0)
    return flat[:, 0], (flat[:, 1:] - flat[:, :1]) * rival.sets[1][:, None]


def _root_after(slopes: Array) -> Array:
    """Roots (designs, n, n) of the covariance (1 + S S^T)^-1 after an experiment with slopes S (designs, n,
    values).

    Numbers are in units of their deviations before.
    """
    information = np.eye(slopes.shape[1]) + slopes @ slopes.swapaxes(1, 2)
    eigenvalues, vectors = np.linalg.eigh(information)
    return np.asarray(vectors / np.sqrt(eigenvalues)[:, None, :])


def distance(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Return the distance (designs,) of two models whose numbers may still move, in standard deviations.

    Of each model it takes the predictions (designs, values) and their slopes, see `weighted`.
    """
    gap, slopes = one[0] - other[0], np.concatenate([one[1], -other[1]], axis=1)
    root = _root_after(slopes)
    moved = np.einsum("dnk,dn->dk", root, np.einsum("dnv,dv->dn", slopes, gap))
    return np.asarray(np.sqrt(np.maximum(np.sum(gap**2, axis=1) - np.sum(moved**2, axis=1), 0.0)))
