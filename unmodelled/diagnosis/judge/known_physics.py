"""The known physics before laws are compared: re-identified, with inputs that run straight or are held."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.judge.classes import BAR
from unmodelled.diagnosis.judge.residual import Residual

#: Simulated samples of the fit, about, and fewest windows of every experiment: a budget of time. Of a machine
#: with more outputs than `FEW_OUTPUTS`, samples are fewer: each says more and takes longer.
SAMPLES, FEWEST_EACH, FEW_OUTPUTS = 20_000, 2, 4
#: Share of the windows over which a fit begins.
BEGINNING = 0.1


@dataclass(frozen=True, eq=False)
class KnownPhysics:
    """The known physics with its uncertain numbers fitted over windows of the horizon."""

    study: Study  # whose inputs are held between samples if the logs say so
    fitted: FittedHypothesis


def known_physics(study: Study, progress: Callable[[str], None]) -> KnownPhysics:
    """Re-identify the known physics, with inputs that run straight between samples or keep their values.

    A digital controller keeps the value of its output until the next sample. States that are as fast as a
    sample, such as the current of a motor, tell the difference, and laws would stand in for it. Inputs are
    held if the evidence for it is what a law needs, and no input then acts at the end of its time frame: an
    input that is held acts half a sample later, which gains where a latency is missing.
    """
    progress("re-identify the known physics")
    recording, known = study.recording.thinned(_windows(study)), Hypothesis.known(study)
    # the error of a long free run has many optima where the model swings, that of a short one has few
    begun = FittedHypothesis.of(known, recording.shortened(BEGINNING)).fit.every
    straight = KnownPhysics(study, FittedHypothesis.of(known, recording, [begun]))
    inputs = tuple(replace(item, hold=True) for item in study.system.inputs)
    if inputs == study.system.inputs:
        return straight
    progress("compare inputs that are held between samples")
    other = replace(study, system=replace(study.system, inputs=inputs))
    fitted = FittedHypothesis.of(Hypothesis.known(other), recording, [straight.fitted.fit.every])
    late = any(fitted.at_bound(name) for name in fitted.hypothesis.timing)
    return KnownPhysics(other, fitted) if _nats(fitted, straight.fitted) > BAR and not late else straight


def _windows(study: Study) -> int:
    """Number of windows of the fit."""
    length = float(study.recording.steps.mean()) * max(1.0, len(study.system.outputs) / FEW_OUTPUTS)
    return max(8, FEWEST_EACH * len(study.recording.runs), round(SAMPLES / length))


def _nats(one: FittedHypothesis, other: FittedHypothesis) -> float:
    """Evidence for a fit against another one with as many numbers."""
    mine, theirs = Residual.of(one), Residual.of(other)
    samples = other.recording.counted.sum() / theirs.tau
    return float(0.5 * np.sum(samples * np.log(theirs.square / mine.square)))
