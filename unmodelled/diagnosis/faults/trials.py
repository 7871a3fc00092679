"""Errors of the known physics under corrected logs, experiment by experiment."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.gap import LARGEST_ERROR, steps_of
from unmodelled.diagnosis.data.options import DEFAULT_OPTIONS, Options
from unmodelled.diagnosis.data.persistence import persistence_errors
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.faults.corrected_logs import Correction
from unmodelled.diagnosis.fitting.deviation import substeps_needed
from unmodelled.diagnosis.fitting.fit import fit_parameters
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Share that a correction explains before parameters are fitted to it, or that is gone without inputs that
#: have nothing to do with the outputs, at least, as a share of the squared error.
SUSPECT_SHARE = 0.25
#: Ratio of squared errors of corrections that cannot be told apart.
EQUAL_ERROR_RATIO = 1.1
#: Squared error of an experiment that may have a fault of its own, in the median of the others, at least.
OUTSTANDING_ERROR = 4.0
#: Simulated samples per question, about (a budget of time), and smallest number of windows per experiment.
QUESTION_SAMPLES, FEWEST_WINDOWS = 6000, 4
#: Iterations of a quick re-identification.
QUICK = 8
#: Largest number of integration steps per sample.
MOST_SUBSTEPS = 4


class Trials:
    """Free runs of one system under many corrections of its logs.

    Errors are in standard deviations within a run: those of each experiment, or the median of all where that
    is larger. So the scale of most experiments does not depend on one that is logged wrongly. Parameter sets
    `numbers` (experiments or 1, 1, numbers) are those of the system unless they are given.
    """

    def __init__(
        self,
        system: System,
        logs: Logs,
        horizon: float,
        sensors: Sensors | None = None,
        options: Options = DEFAULT_OPTIONS,
        numbers: Array | None = None,
    ) -> None:
        self.system, self.logs, self.horizon, self.options = system, logs, horizon, options
        self.sensors, self.numbers = sensors or Sensors(logs), numbers
        self.none = Correction.none(logs)
        self._uncorrected: dict[int, Array] = {}  # fitted numbers by samples of a window

    @cached_property
    def deviations(self) -> Array:
        """Return the standard deviation within every experiment, shape (experiments, outputs)."""
        return self._deviations(self.none)

    def _deviations(self, correction: Correction) -> Array:
        y = correction.read_outputs(self.logs)
        return np.array([y[self.logs.rows(i)].std(axis=0) for i in range(len(self.logs))])

    @cached_property
    def substeps(self) -> int:
        """Return the number of integration steps per sample."""
        simulation = self._simulation(self.none, self.steps(self.none))
        return substeps_needed(simulation, simulation.values[None, None], MOST_SUBSTEPS)[0]

    def steps(self, correction: Correction) -> int:
        """Return the number of samples of a window on the corrected clock."""
        return steps_of(self.horizon, correction.logs(self.system, self.logs))

    def square(self, correction: Correction, steps: int, every: bool = False) -> Array:
        """Return the mean square error (experiments,) of the system as given, over windows and outputs."""
        simulation = self._simulation(correction, steps, every)
        return self._error(simulation, correction, self._given(simulation))

    def typical(self, correction: Correction, steps: int) -> Array:
        """Return the median over windows of their mean square error, (experiments,): no push moves it."""
        simulation = self._simulation(correction, steps, every=True)
        recording = simulation.recording
        square = self._off(simulation, correction, self._given(simulation))[:, 0] ** 2
        each = self._sums(recording, square) / recording.steps
        mine = [each[recording.owner == i] for i in range(len(self.logs))]
        return np.array([np.median(own) if len(own) else 0.0 for own in mine])

    def refitted(self, steps: int) -> Trials:
        """Return the trials of the system with its uncertain parameters quickly fitted to all experiments."""
        numbers = self._fitted(self.none, steps)
        return Trials(self.system, self.logs, self.horizon, self.sensors, self.options, numbers)

    def among(self, runs: list[int]) -> Trials:
        """Return the trials of some experiments."""
        numbers = self.numbers
        if numbers is not None and len(numbers) > 1:
            numbers = numbers[runs]
        return Trials(self.system, self.logs.among(runs), self.horizon, options=self.options, numbers=numbers)

    def persistence(self, steps: int, every: bool = False, correction: Correction | None = None) -> Array:
        """Return the mean square error (experiments,) of persistence: constant values, or speeds.

        A correction that removes inputs and forces has this error on every machine.
        """
        given = correction or self.none
        recording = self._recording(given, steps, every)
        still, on = (
            self._mean(recording, self._in_deviations(off[:, None], recording, given)[:, 0] ** 2)
            for off in persistence_errors(recording.sensors, recording.start[:, None], recording.rows)
        )
        return np.minimum(still, on)

    def identified(self, correction: Correction, steps: int, every: bool = False) -> Array:
        """Return the mean square error (experiments,) with uncertain parameters quickly fitted to all."""
        simulation = self._simulation(correction, steps, every)
        return self._error(simulation, correction, self._fitted(correction, steps))

    def _fitted(self, correction: Correction, steps: int) -> Array:
        """Parameter sets (experiments, 1, numbers), quickly fitted to all experiments."""
        known = self._uncorrected if correction is self.none else {}
        if steps not in known:
            simulation = self._simulation(correction, steps)
            known[steps] = fit_parameters(simulation, iterations=QUICK, substeps=self.substeps).numbers
        return known[steps]

    def _error(self, simulation: Simulation, correction: Correction, numbers: Array) -> Array:
        """Return mean square errors of one parameter set, shape (experiments,)."""
        square = self._off(simulation, correction, numbers)[:, 0] ** 2
        return self._mean(simulation.recording, square)

    def _off(self, simulation: Simulation, correction: Correction, numbers: Array) -> Array:
        """Return cut errors in deviations within runs, shape (windows, sets, most steps, outputs)."""
        found = simulation(numbers, substeps=self.substeps)
        return self._in_deviations(found.y - found.measured, simulation.recording, correction)

    def _in_deviations(self, error: Array, recording: Recording, correction: Correction) -> Array:
        gain = np.abs(correction.gain)
        size = gain * (self.deviations if correction.outputs is None else self._deviations(correction))
        # an experiment near rest would outweigh the others; one that a gain makes small must not count less
        usual = gain / np.median(gain, axis=0)  # a unit that is wrong in all experiments makes none small
        size = np.maximum(size, np.minimum(usual, 1.0) * np.median(size, axis=0))
        size = np.where(size > 0.0, size, 1.0)[recording.owner][:, None, None]
        with np.errstate(all="ignore"):
            error = error / size
        error = np.where(np.isnan(error), LARGEST_ERROR, error)
        return np.clip(error, -LARGEST_ERROR, LARGEST_ERROR)

    def _mean(self, recording: Recording, square: Array) -> Array:
        """Return means, shape (experiments,), of squares of shape (windows, most steps, outputs)."""
        every = self._sums(recording, square), recording.steps
        total, count = (np.bincount(recording.owner, w, len(self.logs)) for w in every)
        # an experiment without a window says nothing: no error
        return np.asarray(np.divide(total, count, out=np.zeros(len(self.logs)), where=count > 0.0))

    @staticmethod
    def _sums(recording: Recording, square: Array) -> Array:
        """Return sums over samples, shape (windows,), of the mean over outputs of squares, as in `_mean`."""
        return np.asarray(np.einsum("wkj,wk->w", square, recording.counted) / square.shape[2])

    def _given(self, simulation: Simulation) -> Array:
        """Return the parameters of these trials, or else those of the system file."""
        return simulation.values[None, None] if self.numbers is None else self.numbers

    def _simulation(self, correction: Correction, steps: int, every: bool = False) -> Simulation:
        return Simulation(self.system, self._recording(correction, steps, every))

    def _recording(self, correction: Correction, steps: int, every: bool = False) -> Recording:
        """Return some or all windows of the corrected logs, from the same instants on every clock."""
        logs = correction.logs(self.system, self.logs)
        latest = max(output.delay for output in self.system.outputs)
        sensors = self.sensors if correction is self.none else correction.sensors(logs, self.sensors)
        recording = Recording.of(logs, steps * logs.period, latest=latest, sensors=sensors)
        count = max(FEWEST_WINDOWS * len(logs), len(logs.y) if every else QUESTION_SAMPLES // steps)
        if (correction.clock == correction.common).all():
            return recording.thinned(count)
        read = Recording.of(self.logs, steps * self.logs.period, latest=latest, sensors=self.sensors)
        return recording.starting(correction.samples(read.thinned(count).start, self.logs, logs))
