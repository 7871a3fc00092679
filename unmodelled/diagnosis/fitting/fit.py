"""Fits of parameters to free runs: robust nonlinear least squares over windows (Levenberg and Marquardt).

The initial state of a window is measured with noise. It is fitted too, with the measurement as its prior, so
that the errors of a true model are those of the sensor noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.fitting.descent import CONVERGED_SHARE, Descent, begin, iterate
from unmodelled.diagnosis.fitting.deviation import Deviation, gap, substeps_needed
from unmodelled.diagnosis.fitting.normal_equations import NormalEquations
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Start, Unknown, Unknowns

#: Iterations of every start before the best one is continued; least samples and windows on which starts are
#: compared.
SCOUTING, SCOUTED_SAMPLES, SCOUTED_WINDOWS = 2, 2000, 8
#: Share of a model's error that the integration may add during a search: more accuracy changes no comparison.
OF_ERROR = 0.05


@dataclass(frozen=True)
class ParameterFit:
    """The result of a fit."""

    values: Mapping[str, float]  # numbers that all experiments share, by name, SI
    own: Mapping[str, Mapping[str, float]]  # numbers that every experiment has for itself, by name and id, SI
    names: tuple[str, ...]  # of the rows of `covariance`; a number of one experiment is name@id
    covariance: Array  # (names, names), SI; inf where the data do not determine a number
    numbers: Array  # parameter sets, (experiments, 1, numbers), for `Simulation`
    start: Array  # corrections of the initial states, (windows, measured states and hidden ones), SI
    gap: Deviation  # from the measured initial states, as the contract defines the gap
    left: Deviation  # from the corrected initial states
    loss: float
    simulations: int  # simulated parameter sets
    substeps: int  # integration steps per sample
    converged: bool  # whether the loss stopped falling before the iterations were used up
    normal: NormalEquations  # at the result

    def variance(self, name: str) -> float:
        """Return the variance of a number, SI; 0 if it was not fitted, inf if it is not determined."""
        return float(self.covariance[(self.names.index(name),) * 2]) if name in self.names else 0.0

    @property
    def every(self) -> Start:
        """Return all fitted numbers by name, own ones by name and id, SI."""
        return {**self.values, **self.own}


def fit_parameters(
    simulation: Simulation,
    unknowns: Sequence[Unknown] | None = None,
    starts: Sequence[Start] = ({},),
    iterations: int = 30,
    substeps: int | None = None,
    share: float = CONVERGED_SHARE,
) -> ParameterFit:
    """Fit unknowns to all windows of a simulation by the method of Levenberg and Marquardt."""
    chosen = tuple(unknowns) if unknowns is not None else _uncertain(simulation)
    every = Unknowns(simulation, chosen)

    def needed(z: Array) -> tuple[Simulation, int]:
        numbers = every.numbers(z[None])
        steps = substeps_needed(simulation, numbers, of_error=OF_ERROR)[0] if substeps is None else substeps
        return simulation.forgetting(numbers, steps), steps

    enough, steps = needed(every.vector(starts[0]))
    first, simulations = _start(enough, chosen, starts, steps)
    (descent,) = begin(Unknowns(enough, chosen), [first], steps, share)
    _descend(descent, iterations)
    # the fit cannot reach fast dynamics that are unstable with the steps that its start needs
    while substeps is None or enough.memory is not None:
        longer, more = needed(descent.z)
        if more <= steps and not enough.forgets_before(longer):
            break
        enough, steps = longer, max(more, steps)
        simulations += descent.errors.simulations
        (descent,) = begin(Unknowns(enough, chosen), [descent.z], steps, share)
        _descend(descent, iterations)
    return _result(descent, simulations)


def _descend(descent: Descent, iterations: int) -> None:
    for _ in range(iterations):
        iterate([descent])
        if descent.converged:
            break


def _uncertain(simulation: Simulation) -> tuple[Unknown, ...]:
    return tuple(Unknown.of(p) for p in simulation.system.parameters if p.identify)


def _start(
    simulation: Simulation, each: tuple[Unknown, ...], starts: Sequence[Start], substeps: int
) -> tuple[Array, int]:
    """The best of some starts after some iterations, and how many sets of numbers that took."""
    if len(starts) == 1:
        return Unknowns(simulation, each).vector(starts[0]), 0
    recording = simulation.recording
    count = max(SCOUTED_WINDOWS, round(SCOUTED_SAMPLES / float(recording.steps.mean())))
    few = Unknowns(simulation.over(recording.thinned(count)), each)
    scouts = begin(few, [few.vector(start) for start in starts], substeps)
    for _ in range(SCOUTING):
        iterate(scouts)
    errors = scouts[0].errors
    r = errors(np.stack([s.z for s in scouts]), np.stack([s.moved for s in scouts], axis=1))
    square = np.mean(r.swapaxes(1, 2)[few.simulation.recording.counted] ** 2, axis=0)
    # a logarithm, so that no output dominates by its unit or its noise
    return scouts[int(np.argmin(np.log(1.0 + square).sum(-1)))].z, errors.simulations


def _result(descent: Descent, simulations: int) -> ParameterFit:
    errors, unknowns = descent.errors, descent.errors.unknowns
    simulation, recording = unknowns.simulation, unknowns.simulation.recording
    around = errors(*errors.around(descent.z, descent.moved))
    r = around[:, 0]
    normal, _ = descent.normal(r, errors.slopes(descent.z, around))
    numbers, unit = unknowns.numbers(descent.z[None]), recording.noise / recording.scale
    ids = [recording.logs.ids[i] for i in sorted(recording.runs)]
    values = unknowns.values(descent.z)
    parts = [values[unknowns.unknown == k] for k in range(len(unknowns.each))]
    named = list(zip(unknowns.each, parts, strict=True))
    return ParameterFit(
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
        loss=descent.loss,
        simulations=simulations + errors.simulations + 1,
        substeps=errors.substeps,
        converged=descent.converged and bool(np.mean(np.abs(r) >= errors.largest) < 0.5),
        normal=normal,
    )
