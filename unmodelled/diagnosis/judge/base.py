"""The known physics with its measurement chain, fitted to windows of one length; and the lengths."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.gap import MATTERS
from unmodelled.diagnosis.data.persistence import persistence
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.deviation import substeps_needed
from unmodelled.diagnosis.fitting.fit import OF_ERROR
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.judge.chain import Key, starts_of_chain, unusual_parts, with_chain
from unmodelled.diagnosis.judge.residual import Residual

#: Lengths of the windows in default horizons. Weak damping shows over long windows only; over whole
#: experiments everything else that is wrong adds up.
LENGTHS = 1.0, 4.0
#: Window samples of a fit, about: a budget of time.
SAMPLES = 8_000
#: Share of the loss by which an iteration must lower it, and most iterations: hypotheses differ by more.
NEAR, ITERATIONS = 1e-3, 15
#: Share of the loss by which a base must be better to be judged again.
BETTER = 0.01
#: Sensor noises from which a gap matters, beside its share of the error of a prediction without a model.
NOISES = 2.0


@dataclass(frozen=True, eq=False)
class Base:
    """The known physics with its chain, fitted to windows of one length."""

    fitted: FittedHypothesis
    physics: FittedHypothesis  # without the chain
    residual: Residual
    tau: float  # correlation time by which priors of a fit are tightened, samples
    substeps: int  # integration steps per sample of further fits

    @property
    def recording(self) -> Recording:
        """Return the windows."""
        return self.fitted.recording

    @property
    def horizon(self) -> float:
        """Return the length of the longest window, s."""
        return self.recording.logs.period * int(self.recording.steps.max())

    def fit(self, hypothesis: Hypothesis, start: Start) -> FittedHypothesis:
        """Fit a hypothesis to the same windows."""
        return _fit(hypothesis, self.recording, start, self.substeps)

    def needed(self, fitted: FittedHypothesis) -> int:
        """Return the integration steps per sample that are short enough beside the error of a fit."""
        simulation = fitted.hypothesis.simulation(self.recording)
        return max(self.substeps, substeps_needed(simulation, fitted.fit.numbers, of_error=OF_ERROR)[0])

    def improved(self, larger: FittedHypothesis) -> Base | None:
        """Return the base fitted from the numbers of a larger hypothesis, None where that is no better.

        What a law makes up for by leading a fit out of a poor optimum is no evidence for the law. Integration
        steps that are short enough beside the error of the base may be too long beside that of a law.
        """
        steps = self.needed(larger)
        fitted = _fit(self.fitted.hypothesis, self.recording, larger.fit.every, steps)
        if steps == self.substeps and fitted.fit.loss > (1.0 - BETTER) * self.fitted.fit.loss:
            return None
        return replace(self, fitted=fitted, residual=Residual.of(fitted), substeps=steps)

    def matters(self, residual: Residual) -> bool:
        """Return whether a residual is above the noise of the sensors and a share of the motion."""
        return bool(np.any((np.sqrt(residual.square) > NOISES) & (self.share(residual) > MATTERS)))

    def share(self, residual: Residual) -> Array:
        """Return a residual in errors of a prediction without a model, (outputs,)."""
        return np.asarray(self.in_deviations(residual) / persistence(self.recording))

    def in_deviations(self, residual: Residual) -> Array:
        """Return a residual in standard deviations of the outputs, (outputs,)."""
        return np.asarray(np.sqrt(residual.square) * self.recording.noise / self.recording.scale)


def bases(study: Study, begun: FittedHypothesis) -> Iterator[Base]:
    """Yield the base at every length, each fit carried from the shorter one.

    A long free run that is far off cannot be linearised: started from its own fit over a third of the length,
    a right law leaves 0.5 % where a cold start diverges. `begun` is a fit of the known physics.
    """
    shorter: Start | None = None
    for horizon in _horizons(study):
        base = _base(replace(study, horizon=horizon), begun, shorter)
        shorter = base.fitted.fit.every
        yield base


def _horizons(study: Study) -> list[float]:
    """Lengths, s, each once and none longer than the longest experiment."""
    period = study.logs.period
    longest = period * float(np.diff(study.logs.offsets).max())
    steps = (max(1, round(min(times * study.horizon, longest) / period)) for times in LENGTHS)
    return [n * period for n in dict.fromkeys(steps)]


def _base(study: Study, begun: FittedHypothesis, shorter: Start | None) -> Base:
    recording = study.recording
    count = max(len(recording.runs), 8, round(SAMPLES / float(recording.steps.mean())))
    recording, substeps = recording.thinned(count), begun.fit.substeps
    physics = _fit(Hypothesis.known(study), recording, begun.fit.every, substeps)
    tau = float(Residual.of(physics).tau.max())
    chained = _chained(physics, tau, shorter, ())
    without = list[Key]()
    while unusual := unusual_parts(chained, tau):
        without += unusual
        chained = _chained(physics, tau, shorter, without)
    return Base(chained, physics, Residual.of(chained), tau, substeps)


def _chained(
    physics: FittedHypothesis, tau: float, shorter: Start | None, without: Collection[Key]
) -> FittedHypothesis:
    """The known physics with its chain, but for some parts, from its numbers and from a shorter fit."""
    hypothesis = with_chain(physics.hypothesis, tau, without)
    cold: list[Start] = [{**physics.fit.every, **start} for start in starts_of_chain(hypothesis)]
    starts = cold if shorter is None else [*cold, {**cold[0], **shorter}]
    found = [_fit(hypothesis, physics.recording, start, physics.fit.substeps) for start in starts]
    return min(found, key=_left)


def _fit(hypothesis: Hypothesis, recording: Recording, start: Start, substeps: int) -> FittedHypothesis:
    return FittedHypothesis.of(hypothesis, recording, [start], ITERATIONS, substeps, NEAR)


def _left(fitted: FittedHypothesis) -> float:
    """What a fit leaves, every output in its own unit: a sum of logarithms of squares."""
    return float(np.log(Residual.of(fitted).square).sum())
