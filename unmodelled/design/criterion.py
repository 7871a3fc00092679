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
    """Value of simulated experiments.

    Attributes:
        excess: largest excess of a travel limit by any model, shape (designs,), as a share of the limit's
            width; 0 within all limits, inf where a simulation diverges.
        distances: distance of every alternative from the named model, shape (designs, alternatives), in
            standard deviations; nan beyond the limits.
        after: standard deviations of the named model's numbers after the experiment, shape (designs,
            numbers), SI; nan beyond the limits.
    """

    excess: Array
    distances: Array
    after: Array


@dataclass(frozen=True, eq=False)
class Criterion:
    """Criterion of an experiment.

    The distance of two models is the T-criterion (Atkinson and Fedorov 1975): the weighted squared gap of
    their outputs, minimised over the numbers of both within their uncertainty. With one model, the numbers'
    covariance after the experiment counts (A-optimality). An output's weight is 1/(noise² + samples spread²):
    noise differs from sample to sample; what experiments of one machine differ by may last a whole run, and
    does not average out.

    Attributes:
        rivals: the named model, then its alternatives.
        limits: limits of the experiment.
        noise: standard deviation of the sensor noise, shape (outputs,), in units of the outputs.
        spread: error of the named model over whole runs beyond the noise, shape (outputs,), in these units.
        numbers: numbers of the named model whose relative intervals count if there are no alternatives.
    """

    rivals: Sequence[Rival]
    limits: Limits
    noise: Array
    spread: Array
    numbers: Sequence[str]

    def __call__(self, u: Array) -> Value:
        """Simulate experiments and compute their value.

        Takes u (designs, samples, inputs) in SI.
        """
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
        """Return what a search maximises: positive within the limits, below -1 beyond them.

        Gives (designs,).
        """
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
        """Return the root mean square of the relative standard deviations of the counted numbers.

        Takes deviation (designs, numbers) in SI; gives (designs,).
        """
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
    """Return the predictions of a model and their slopes by its numbers.

    Takes y (designs, sets, samples, outputs); gives (designs, values) and (designs, numbers, values).
    """
    flat = np.nan_to_num(y.reshape(*y.shape[:2], -1), posinf=0.0, neginf=0.0)
    return flat[:, 0], (flat[:, 1:] - flat[:, :1]) * rival.sets[1][:, None]


def _root_after(slopes: Array) -> Array:
    """Roots (designs, n, n) of the covariance (1 + S S^T)^-1 after an experiment, of numbers in units of
    their deviations before; slopes S: (designs, n, values).
    """
    information = np.eye(slopes.shape[1]) + slopes @ slopes.swapaxes(1, 2)
    eigenvalues, vectors = np.linalg.eigh(information)
    return np.asarray(vectors / np.sqrt(eigenvalues)[:, None, :])


def distance(one: tuple[Array, Array], other: tuple[Array, Array]) -> Array:
    """Return the distance of two models whose numbers may still move, in standard deviations.

    Takes one (designs, values), other (designs, values); gives (designs,).
    """
    gap, slopes = one[0] - other[0], np.concatenate([one[1], -other[1]], axis=1)
    root = _root_after(slopes)
    moved = np.einsum("dnk,dn->dk", root, np.einsum("dnv,dv->dn", slopes, gap))
    return np.asarray(np.sqrt(np.maximum(np.sum(gap**2, axis=1) - np.sum(moved**2, axis=1), 0.0)))
