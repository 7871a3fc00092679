"""The result of a diagnosis: verdict, effects that explain the gap, judged models, faults of the logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from unmodelled.diagnosis.data.gap import Gap
from unmodelled.effects.added import Added
from unmodelled.effects.place import Place
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Interval = tuple[float, float]

Verdict = Literal["effect", "main_effect", "no_gap", "unknown", "check_logs"]


@dataclass(frozen=True, eq=False)
class JudgedModel:
    """A model with its gap on the held-out experiments.

    Attributes:
        label: name of the model, such as "known" or "with coulomb_friction at rail".
        system: system with the model's numbers, ready to be written as a file.
        logs: all experiments, with the states and constants of `system`.
        gap: gap on the held-out experiments.
    """

    label: str
    system: System
    logs: Logs
    gap: Gap


@dataclass(frozen=True)
class Estimate:
    """An identified number of the augmented model, in SI units.

    Attributes:
        unit: unit of the number.
        known: value in the given system file; nan for a number of an effect.
        value: identified value.
        interval: 95 % confidence interval, cut at the bounds.
        determined: whether the logs determine the number, default True.
        at_bound: whether the number ended at one of its bounds, default False.
    """

    unit: str
    known: float
    value: float
    interval: Interval
    determined: bool = True
    at_bound: bool = False


@dataclass(frozen=True, eq=False)
class DiagnosedEffect:
    """A diagnosed effect.

    Attributes:
        added: effect and place; its law is written in names of `added.system`.
        estimates: fitted numbers of the law, by name (`Added.reported`).
        own: amplitudes that differ between experiments, by name and then by id of the experiment, SI.
        confidence: probability that this effect, or one of `indistinguishable`, is right; 0 to 1.
        shrink: share of the squared gap above the noise floor that this effect explains; 0 to 1.
        interval: 95 % interval of `shrink` over the held-out experiments.
        indistinguishable: effects that these data cannot tell from this one, the best first.
    """

    added: Added
    estimates: Mapping[str, Estimate]
    own: Mapping[str, Mapping[str, float]]
    confidence: float
    shrink: float
    interval: Interval
    indistinguishable: tuple[Added, ...]


@dataclass(frozen=True, eq=False)
class Compared:
    """A candidate beside the named one, by predictions of experiments that took no part in its fit.

    Attributes:
        effects: effects of the candidate; none for the re-identified physics.
        score: mean over left-out experiments and outputs of ln(mean square error / noise variance + 1), nats.
        difference: mean paired difference of the score from that of the named candidate; positive is worse.
        standard_error: standard error of the difference.
        named: whether it is the named candidate.
    """

    effects: tuple[Added, ...]
    score: float
    difference: float
    standard_error: float
    named: bool


@dataclass(frozen=True)
class Remainder:
    """Error that is left with the named effects, and the part of it that a flexible model predicts.

    Attributes:
        share: squared error of left-out predictions, relative to that of the re-identified physics.
        predictable: part of `share` that a network in every port predicts in left-out experiments; 0 if it
            predicts none beyond chance.
        place: place of the further effect that predicts best; None if none was fitted.
    """

    share: float
    predictable: float
    place: Place | None


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The explanation of the gap between a system and measured experiments.

    The terms are defined in shared/contracts/diagnosis.md.

    Attributes:
        system: system as given.
        logs: logs as given, without copies of experiments.
        horizon: length of the free-run windows, s.
        seed: seed of all random draws.
        verdict: effect, main_effect, no_gap, unknown or check_logs.
        confidence: calibrated probability that verdict and effects are right; 0 to 1.
        chance: probability that the best of all laws lowers the error as much if nothing is missing; None
            where nothing was searched.
        effects: diagnosed effects, the strongest first.
        remainder: error that a flexible model predicts beyond the effects, or that is too large to be all;
            None if there is none.
        known: the system as given.
        reidentified: the known physics with its uncertain parameters fitted.
        augmented: the physics with the effects; `reidentified` where there are none.
        neural: the physics with a network in every port.
        steps: models from `reidentified` to `augmented`, with one effect more each.
        floor: noise floor of the gap of `augmented`, in standard deviations of the outputs.
        shrink: share of the squared gap above the noise floor that the effects explain; 0 to 1.
        interval: 95 % interval of `shrink` over the held-out experiments.
        held_out: numbers of the experiments that took no part in fitting or choosing.
        parameters: estimates of the system's uncertain parameters, by name.
        comparison: fitted candidates, the best first.
        notes: remarks on logs, models and integration, a sentence each.
        correlations: correlations of the fitted numbers by pair of names (jackknife).
        faults: faults of the logs. With the verdict check_logs they are the answer, nothing was fitted, and
            all models are the known one.
    """

    system: System
    logs: Logs
    horizon: float
    seed: int
    verdict: Verdict
    confidence: float
    chance: float | None
    effects: tuple[DiagnosedEffect, ...]
    remainder: Remainder | None
    known: JudgedModel
    reidentified: JudgedModel
    augmented: JudgedModel
    neural: JudgedModel
    steps: tuple[JudgedModel, ...]
    floor: float
    shrink: float
    interval: Interval
    held_out: tuple[int, ...]
    parameters: Mapping[str, Estimate]
    comparison: tuple[Compared, ...]
    notes: tuple[str, ...]
    faults: tuple[LogFault, ...] = ()
    correlations: Mapping[tuple[str, str], float] = field(default_factory=dict)


@dataclass(frozen=True)
class LogFault:
    """A fault of the logs.

    Attributes:
        channels: names of the faulty outputs and inputs; `t` for time, `experiments` for whole logs.
        problem: name of the fault, such as "degrees" or "sign".
        explains: share of the known model's mean square error that the correction removes; None where the
            fault does not concern the error.
        experiments: ids of the faulty experiments; () for all.
        sentence: observation and what to do about it.
        decides: whether the fault decides the diagnosis.
        indistinguishable: channels and problem of other faults that explain as much.
    """

    channels: tuple[str, ...]
    problem: str
    explains: float | None
    experiments: tuple[str, ...]
    sentence: str
    decides: bool
    indistinguishable: tuple[tuple[tuple[str, ...], str], ...] = ()
