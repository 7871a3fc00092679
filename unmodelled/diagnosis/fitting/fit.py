"""Parameters of a system, fitted to free runs: robust nonlinear least squares over windows.

The state at which a window starts is measured with noise. It is fitted too, with the measurement as its
prior, so that a model without fault comes down to the noise of the sensors.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.fitting.deviation import Deviation, gap, substeps_needed
from unmodelled.diagnosis.fitting.floor import start_noise
from unmodelled.diagnosis.fitting.normal_equations import NormalEquations
from unmodelled.diagnosis.fitting.residuals import Errors, loss, spread, weights
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown, Unknowns

Array = NDArray[np.float64]

#: Iterations of every start before the best one goes on, and windows that they are tried on.
SCOUTING, SCOUTED = 2, 40


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    Attributes:
        values: of what all experiments share, SI. own: of every other unknown, by id of the experiment.
        names: of the rows of `covariance`; those of an experiment as name@id.
        covariance: of the fitted numbers, SI; inf where the data do not tell.
        numbers: (experiments, 1, numbers) that `Simulation` takes.
        start: (windows, measured states) by how much the states at the starts were corrected.
        gap: from the measured starts, as the contract defines it. left: from the corrected ones.
        scale: (outputs,) robust spread of the errors that are left, in the unit of the output.
        loss: what was minimised. simulations: how many sets of numbers were simulated.
        substeps: of the integration. converged: whether the loss stopped falling before the iterations were
            used up.
    """

    values: Mapping[str, float]
    own: Mapping[str, Mapping[str, float]]
    names: tuple[str, ...]
    covariance: Array
    numbers: Array
    start: Array
    gap: Deviation
    left: Deviation
    scale: Array
    loss: float
    simulations: int
    substeps: int
    converged: bool


def fit(
    simulation: Simulation,
    unknowns: Sequence[Unknown] | None = None,
    starts: Sequence[Mapping[str, float]] = ({},),
    iterations: int = 30,
    substeps: int | None = None,
) -> Fit:
    """Fit `unknowns` to all windows of `simulation` by the method of Levenberg and Marquardt.

    Args:
        unknowns: the uncertain parameters of the system unless given.
        starts: values to start from, those of the system where a name is missing. Of several, the one that is
            best after some iterations on some of the windows goes on.
        iterations: at most. substeps: steps of the integration per sample; as many as the first of the
            starts needs unless given.
    """
    chosen = tuple(unknowns) if unknowns is not None else _uncertain(simulation)
    if substeps is None:
        every = Unknowns(simulation, chosen)
        substeps, _ = substeps_needed(simulation, every.numbers(every.vector(starts[0])[None]))
    first, simulations = _start(simulation, chosen, starts, substeps)
    (descent,) = begun(Unknowns(simulation, chosen), [first], substeps)
    for _ in range(iterations):
        advance([descent])
        if descent.converged:
            break
    return _result(descent, simulations)


def _uncertain(simulation: Simulation) -> tuple[Unknown, ...]:
    return tuple(Unknown.of(p) for p in simulation.system.parameters if p.identify)


def _start(
    simulation: Simulation, each: tuple[Unknown, ...], starts: Sequence[Mapping[str, float]], substeps: int
) -> tuple[Array, int]:
    """The best of some starts after some iterations, and how many sets of numbers that took."""
    if len(starts) == 1:
        return Unknowns(simulation, each).vector(starts[0]), 0
    few = Unknowns(simulation.over(simulation.recording.thinned(SCOUTED)), each)
    scouts = begun(few, [few.vector(start) for start in starts], substeps)
    for _ in range(SCOUTING):
        advance(scouts)
    errors = scouts[0].errors
    r = errors(np.stack([s.z for s in scouts]), np.stack([s.moved for s in scouts], axis=1))
    square = np.mean(r.swapaxes(1, 2)[few.simulation.recording.counted] ** 2, axis=0)
    # a logarithm, so that no output dominates by its unit or its noise
    return scouts[int(np.argmin(np.log(1.0 + square).sum(-1)))].z, errors.simulations


def _result(descent: Descent, simulations: int) -> Fit:
    errors, unknowns = descent.errors, descent.errors.unknowns
    simulation, recording = unknowns.simulation, unknowns.simulation.recording
    around = errors(*errors.around(descent.z, descent.moved))
    normal, scale = descent.normal(around)
    r = around[:, 0]
    numbers, unit = unknowns.numbers(descent.z[None]), recording.noise / recording.scale
    ids = [recording.logs.ids[i] for i in sorted(recording.runs)]
    values = descent.z * unknowns.scale
    parts = [values[unknowns.unknown == k] for k in range(len(unknowns.each))]
    named = list(zip(unknowns.each, parts, strict=True))
    return Fit(
        values={u.name: float(part[0]) for u, part in named if not u.own},
        own={u.name: dict(zip(ids, part.tolist(), strict=True)) for u, part in named if u.own},
        names=tuple(
            f"{u.name}@{i}" if u.own else u.name for u in unknowns.each for i in (ids if u.own else [""])
        ),
        covariance=normal.covariance() * np.outer(unknowns.scale, unknowns.scale),
        numbers=numbers,
        start=descent.moved * errors.sigma,
        gap=gap(simulation, numbers, errors.substeps),
        left=Deviation.of(recording, (r * unit) ** 2),
        scale=scale * recording.noise,
        loss=descent.loss,
        simulations=simulations + errors.simulations + 1,
        substeps=errors.substeps,
        converged=descent.converged and bool(np.mean(np.abs(r) >= errors.largest) < 0.5),
    )


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

    def normal(self, r: Array) -> tuple[NormalEquations, Array]:
        """Normal equations here, from the errors around, and the errors' robust spread (outputs,)."""
        unknowns, here = self.errors.unknowns, r[:, 0]
        scale = spread(here, unknowns.simulation.recording.counted)
        slopes = self.errors.slopes(self.z, r)
        normal = NormalEquations.of(
            here, slopes, weights(here, scale), self.moved, unknowns.entry, unknowns.precision
        )
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
