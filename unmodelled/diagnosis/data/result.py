"""The result of a diagnosis: verdict, effects that explain the gap, judged models, faults of the logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.gap import Gap
from unmodelled.diagnosis.data.remark import Kind
from unmodelled.diagnosis.data.spread import Spread
from unmodelled.effects.added import Added
from unmodelled.effects.place import Place
from unmodelled.engine.machine.program import Program
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Interval = tuple[float, float]

Verdict = Literal["effect", "main_effect", "no_gap", "unknown", "check_logs"]


@dataclass(frozen=True, eq=False)
class JudgedModel:
    """A model with its gap of experiments left out."""

    label: str  # such as "known" or "with Coulomb friction at rail"
    system: System  # with the model's numbers, ready to be written as a file
    logs: Logs  # all experiments, with the states and constants of `system`
    gap: Gap  # of experiments left out

    def along(self, expressions: Sequence[sp.Expr], most: int, values: Mapping[str, float]) -> Array:
        """Return expressions (samples, expressions) at `most` samples, evenly from all experiments.

        Some parameters have other values; efforts are zero.
        """
        logs, p = self.logs, np.array(self.system.with_values(values).values)
        some = np.arange(0, len(logs.t), -(-len(logs.t) // most))
        program = Program.of_values(self.system, expressions)
        return program.evaluate(logs.t[some], logs.x[some], logs.u[some], p, logs.c[logs.owner[some]])


@dataclass(frozen=True)
class Estimate:
    """An identified number of the augmented model, in SI units."""

    unit: str
    known: float  # value in the given system file; nan for a number of an effect
    value: float
    interval: Interval  # 95 %, cut at the bounds
    determined: bool = True  # whether the logs determine the number
    at_bound: bool = False  # whether it ended at one of its bounds
    remarks: tuple[Kind, ...] = ()  # kinds of the remarks on it
    spread: Spread | None = None  # from which intervals follow; None for a number that was not fitted

    @property
    def sure(self) -> bool:
        """Return whether a title may tell the number: no remark is on it."""
        return self.determined and not self.at_bound and not self.remarks


@dataclass(frozen=True, eq=False)
class DiagnosedEffect:
    """A diagnosed effect."""

    added: Added  # its law is written in names of `added.system`
    estimates: Mapping[str, Estimate]  # numbers of the law, by name (`Added.reported`)
    own: Mapping[str, Mapping[str, float]]  # amplitudes that differ between experiments, by name and id, SI
    confidence: float  # probability, 0 to 1, that this effect or one of `indistinguishable` is right
    shrink: float  # share of the squared gap above the noise floor that it explains, 0 to 1
    interval: Interval  # 95 % interval of `shrink` over the experiments
    indistinguishable: tuple[Added, ...]  # the best first
    #: Effects without which it lowers the error by less than a material share.
    only_with: tuple[Added, ...] = ()
    step: int = 0  # number of its model among those with effects in `Diagnosis.steps`
    kind: str = ""  # what the logs decide first, such as dry friction; "" where laws have no kinds
    #: Probabilities of the law and of those in `indistinguishable`, in their order; none where not known.
    probabilities: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Compared:
    """A candidate beside the named one, by predictions of experiments that took no part in its fit."""

    effects: tuple[Added, ...]  # none for the re-identified physics
    #: Mean over left-out experiments and outputs of ln(mean square error / noise variance + 1), nats.
    score: float
    difference: float  # mean paired difference of the score from that of the named one; positive is worse
    standard_error: float  # of the difference
    named: bool
    #: Calibrated probability of the last of the effects beside those before it; None where another form
    #: stands for it, or where it was not compared.
    probability: float | None = None
    #: Root mean square errors of free runs over windows of one length (s), by output, SI; `horizon` is nan
    #: where they are not known.
    errors: Mapping[str, float] = field(default_factory=dict)
    horizon: float = float("nan")


@dataclass(frozen=True, eq=False)
class ChainPart:
    """Number of the measurement chain: what a drive, a sensor or the logger adds to every log."""

    added: Added  # such as a delay of an output; `added.place` says where
    value: float  # SI; the size of the deviations of experiments where it differs between them
    error: float  # standard error, SI; nan where it is not known
    unit: str
    per_experiment: bool  # whether the number differs between experiments


@dataclass(frozen=True, eq=False)
class Evidence:
    """Evidence of a law beside the known physics and its chain, over windows of one length."""

    added: Added
    horizon: float  # length of the windows, s
    nats: float  # log evidence over the known physics, after the price of its numbers
    removed: float  # share of the squared residual that it removes, of the output where it is largest


@dataclass(frozen=True)
class FitEnd:
    """End of a fit."""

    converged: bool  # whether the error stopped falling before the iterations were used up
    evaluations: int  # simulated sets of numbers


@dataclass(frozen=True)
class Remainder:
    """Error that is left with the named effects, and the part of it that a flexible model predicts."""

    share: float  # squared error of left-out predictions, relative to that of the re-identified physics
    #: Part of `share` that a network in every port predicts in left-out experiments; 0 if none beyond chance.
    predictable: float
    place: Place | None  # of the further effect that predicts best; None if none was fitted


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The explanation of the gap between a system and experiments."""

    system: System  # as given
    logs: Logs  # as given, without copies of experiments
    horizon: float  # length of the free-run windows, s
    seed: int
    verdict: Verdict
    confidence: float  # calibrated probability, 0 to 1, that verdict and effects are right
    #: Probability that the best of all laws lowers the error as much if nothing is missing.
    chance: float | None  # None where nothing was searched
    effects: tuple[DiagnosedEffect, ...]  # those with the largest shares first
    remainder: Remainder | None  # None if a flexible model predicts no more and the rest is small
    known: JudgedModel  # the system as given
    reidentified: JudgedModel  # the known physics with its uncertain parameters fitted
    augmented: JudgedModel  # with the effects; `reidentified` where there are none
    neural: JudgedModel  # with a network in every port
    steps: tuple[JudgedModel, ...]  # from `reidentified` to `augmented`, with one effect more each
    floor: float  # of `augmented`, in standard deviations of the outputs
    shrink: float  # share of the squared gap above the noise floor that the effects explain, 0 to 1
    interval: Interval  # 95 % interval of `shrink` over the experiments
    held_out: tuple[int, ...]  # numbers of the experiments that took no part in fitting or choosing
    parameters: Mapping[str, Estimate]  # the uncertain ones, by name
    comparison: tuple[Compared, ...]  # fitted candidates, the best first
    notes: tuple[str, ...]  # on logs, models and integration, a sentence each
    #: Of the verdict check_logs they are the answer: nothing was fitted, and all models are `known`.
    faults: tuple[LogFault, ...] = ()
    #: Correlations of the fitted numbers, by pair of names (jackknife).
    correlations: Mapping[tuple[str, str], float] = field(default_factory=dict)
    chain: tuple[ChainPart, ...] = ()  # how the logs were made: what pays of the measurement chain
    evidence: tuple[Evidence, ...] = ()  # of laws by length of the windows, the shortest first
    alike: Evidence | None = None  # of the most alike law where none is named
    strangers: tuple[str, ...] = ()  # ids of experiments that the named effects do not predict better
    fit: FitEnd | None = None  # of the numbers that leave; None where nothing was fitted


@dataclass(frozen=True)
class LogFault:
    """A fault of the logs."""

    channels: tuple[str, ...]  # faulty outputs and inputs; `t` for time, `experiments` for whole logs
    problem: str  # such as "degrees" or "sign"
    #: Share of the known model's mean square error that the correction removes.
    explains: float | None  # None where the samples show it without this error
    experiments: tuple[str, ...]  # ids of the faulty ones; () for all
    sentence: str  # observation and what to do about it
    decides: bool  # whether the fault decides the diagnosis
    #: Channels and problem of faults that explain as much.
    indistinguishable: tuple[tuple[tuple[str, ...], str], ...] = ()
