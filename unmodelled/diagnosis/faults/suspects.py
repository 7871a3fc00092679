"""A fault of the logs that may explain the gap, and laws that explain as much."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.base.arrays import Array, Mask
from unmodelled.diagnosis.data.options import Options
from unmodelled.diagnosis.faults.corrected_logs import Correction
from unmodelled.diagnosis.faults.fits import CLOCK_PROBLEM, WRONG, factors_of
from unmodelled.diagnosis.faults.questions import FACTOR_PROBLEM, GIVEN, Question
from unmodelled.diagnosis.faults.replaced_columns import later_inputs
from unmodelled.diagnosis.faults.trials import OUTSTANDING_ERROR, Trials
from unmodelled.effects.coulomb_friction import CoulombFriction
from unmodelled.effects.effect import PortEffect
from unmodelled.effects.nonlinear_spring import HardeningSpring
from unmodelled.effects.parameter_error import ParameterError
from unmodelled.effects.scales import Scales
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import Parameter, System, symbol

#: Share of the error of all experiments that a fault in some explains at least [share of the squared error].
FAULT_SHARE_SOME = 0.5
#: Squared error that a law leaves against a wrong clock, at least: another inertia where the clock of all
#: experiments is wrong, stiffening springs where that of one is. An input of less or no effect leaves at
#: least as many times what a drive that saturates leaves [1].
CLOCK_ERROR_RATIO = 2.0
#: Largest number of a spring or a friction, in plausible sizes.
SPRING = 10.0
#: Times by which inputs may act later in one experiment, in horizons, and their gains there.
LATER, GAINS = np.linspace(-1.0, 1.0, 21), np.linspace(0.5, 1.5, 21)
#: Limits of a drive, as shares of the largest input and of its largest change within a sample.
LIMITS = np.geomspace(0.01, 0.5, 9)


@dataclass(frozen=True, eq=False)
class Suspect:
    """A correction of some experiments that may explain the gap."""

    question: Question  # its correction changes only the experiments in `runs`
    runs: Mask  # corrected ones, (experiments,)
    steps: int  # samples of a window
    before: Array  # mean square errors of the logs as read, (experiments,)
    after: Array  # mean square errors of the corrected logs, (experiments,)

    @property
    def explains(self) -> float:
        """Return the explained share of the mean square error of all experiments."""
        whole = float(self.before.sum())
        return 1.0 - float(self.after.sum()) / whole if whole > 0.0 else 0.0

    @property
    def everywhere(self) -> bool:
        """Return whether all experiments have the fault."""
        return bool(self.runs.all())

    @property
    def explains_where_it_is(self) -> float:
        """Return the explained share of the mean square error of the corrected experiments."""
        return 1.0 - float(self.after[self.runs].sum()) / max(float(self.before[self.runs].sum()), 1e-300)

    def weakens(self, inputs: Sequence[str]) -> bool:
        """Return whether the correction lowers the gain of inputs only."""
        correction, own = self.question.correction, {*self.question.channels} <= {*inputs}
        return own and correction.inputs is None and bool(np.abs(correction.drive).min() < 1.0)

    def is_enough(self, options: Options) -> bool:
        """Return whether the fault explains most of the error of its experiments, and enough of all error."""
        most, some = options.fault_share, FAULT_SHARE_SOME
        return self.explains_where_it_is >= most and self.explains >= some


def explained_by_law(trials: Trials, suspect: Suspect) -> bool:
    """Return whether a law explains as much as a wrong clock, factor or unit.

    If the clock of all experiments or the factor of a channel is wrong, it is another inertia, such as that
    of a rotor, with dry friction, or a wrong number of the file. If that of one experiment is, it is
    stiffening springs, or what acts on this experiment. If an input has less effect, or outputs another
    factor, a drive is limited. If the unit of a channel is wrong everywhere, it is any gain of a drive or a
    sensor.
    """
    problem = suspect.question.problem.name
    weaker = problem != CLOCK_PROBLEM and suspect.weakens(trials.logs.inputs)
    if (weaker or problem == FACTOR_PROBLEM) and _is_limited(trials, suspect):
        return True
    if problem in GIVEN and suspect.everywhere:
        return _is_gain(trials, suspect)
    if problem not in (CLOCK_PROBLEM, FACTOR_PROBLEM):
        return False
    system, logs, every = trials.system, trials.logs, not suspect.everywhere
    if suspect.everywhere or problem == FACTOR_PROBLEM:
        others = [_with_friction(_with_inertia(system), logs), *_with_free_numbers(system)]
    elif _acts_otherwise(trials, suspect):
        return True
    else:
        others = [_with_springs(system, logs)]

    def left(other: System) -> float:
        found = Trials(other, logs, trials.horizon, trials.sensors, trials.options)
        return float(found.identified(found.none, suspect.steps, every).sum())

    most = CLOCK_ERROR_RATIO * float(suspect.after.sum())
    return any(left(other) < most for other in others)


def _is_gain(trials: Trials, suspect: Suspect) -> bool:
    """Return whether a fitted factor of channels leaves clearly less than another unit."""
    gains = factors_of(trials, suspect.steps, suspect.runs)
    left = (float(trials.identified(each.correction, suspect.steps).sum()) for each in gains)
    return CLOCK_ERROR_RATIO * min(left, default=np.inf) < float(suspect.after.sum())


def _is_limited(trials: Trials, suspect: Suspect) -> bool:
    """Return whether inputs that are limited, or whose rate is, leave clearly less than the suspect.

    They may be so in all experiments: one with large or quick commands stands out.
    """
    logs, every = trials.logs, not suspect.everywhere
    mine = np.isin(logs.inputs, suspect.question.channels)
    mine = mine if mine.any() else np.ones(len(logs.inputs), np.bool_)
    largest = np.abs(logs.u).max(axis=0, initial=0.0)
    cut = [np.clip(logs.u, -share * largest, share * largest) for share in LIMITS]
    limited = [Correction.replaced(logs, np.where(mine, u, logs.u)) for u in (*cut, *slowed(logs))]
    limited += [] if suspect.everywhere else [one.only(suspect.runs) for one in limited]
    left = min(float(trials.identified(one, suspect.steps, every).sum()) for one in limited)
    return CLOCK_ERROR_RATIO * left < float(suspect.after.sum())


def slowed(logs: Logs) -> Array:
    """Return inputs (limits, samples, inputs) whose changes within a sample are limited."""
    change = np.diff(logs.u, axis=0, prepend=logs.u[:1])
    change[logs.offsets[:-1]] = 0.0
    most = LIMITS[:, None] * np.abs(change).max(axis=0, initial=0.0)
    slow = np.repeat(logs.u[None], len(LIMITS), axis=0)
    for k in np.setdiff1d(np.arange(len(logs.u)), logs.offsets[:-1]).tolist():
        slow[:, k] = slow[:, k - 1] + np.clip(logs.u[k] - slow[:, k - 1], -most, most)
    return slow


def _acts_otherwise(trials: Trials, suspect: Suspect) -> bool:
    """Return whether inputs that act later, or with another gain, explain what a clock of one run does.

    The time of a flow depends on the flow: with later inputs, the experiment stands out no more. A supply
    varies from run to run: with another gain, hardly more is left than with another clock.
    """
    known = trials.refitted(suspect.steps)
    return any(_acts_otherwise_in(known, suspect, run) for run in np.flatnonzero(suspect.runs).tolist())


def _acts_otherwise_in(known: Trials, suspect: Suspect, run: int) -> bool:
    alone = known.among([run])
    times = np.unique(np.rint(LATER * suspect.steps)).astype(int).tolist()
    later = (later_inputs(alone.logs, samples) for samples in times)
    stronger = (replace(alone.none, drive=gain * alone.none.drive) for gain in GAINS)
    late, strong = (
        min(float(alone.square(each, suspect.steps, every=True)[0]) for each in tried)
        for tried in (later, stronger)
    )
    usual = OUTSTANDING_ERROR * float(np.median(suspect.before[~suspect.runs]))
    return late < usual or strong < CLOCK_ERROR_RATIO * float(suspect.after[run])


def _with_inertia(system: System) -> System:
    """Return the system with all accelerations times a factor: a wrong clock, except on damping."""
    name = "factor_of_all_accelerations"
    free = Parameter(name, "1", 1.0, identify=True, bounds=WRONG)
    dynamics = tuple(f if f in system.x else symbol(name) * f for f in system.dynamics)
    return replace(system, dynamics=dynamics, parameters=(*system.parameters, free))


def _with_springs(system: System, logs: Logs) -> System:
    """Return the system with a stiffening spring of unknown numbers at every port.

    An experiment that moves further than the others then swings faster than they do, as with a fast clock.
    """
    return _everywhere(HardeningSpring(), system, logs, -SPRING)


def _with_friction(system: System, logs: Logs) -> System:
    """Return the system with a dry friction of unknown size at every port that moves."""
    return _everywhere(CoulombFriction(), system, logs, 0.0)


def _with_free_numbers(system: System) -> Iterator[System]:
    """Yield the system with each number of the file free that may be wrong (`ParameterError`)."""
    for place in ParameterError().places(system):
        each = (
            replace(p, identify=True, bounds=_around(p.value)) if p.name == place.name else p
            for p in system.parameters
        )
        yield replace(system, parameters=tuple(each))


def _around(value: float) -> tuple[float, float]:
    low, high = sorted(factor * value for factor in WRONG)
    return low, high


def _everywhere(law: PortEffect, system: System, logs: Logs, lowest: float) -> System:
    """The system with a law at all places; its amplitudes are from `lowest` to `SPRING` plausible sizes."""
    scales = Scales.measured(system, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)
    for place in law.places(system):
        added = law.add(system, place, scales)
        reach = {name: (lowest * size, SPRING * size) for name, size in added.scales.items()}
        free = [
            replace(p, identify=True, bounds=reach[p.name]) if p.name in added.amplitudes else p
            for p in added.system.parameters
        ]
        system = replace(added.system, parameters=tuple(free))
    return system
