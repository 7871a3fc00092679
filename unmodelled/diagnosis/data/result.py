"""What a diagnosis says: a verdict, the effects that explain the gap, and the models that show it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from unmodelled.diagnosis.data.gap import Gap
from unmodelled.effects.added import Added
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Interval = tuple[float, float]

Verdict = Literal["effect", "no_gap", "unknown", "check_logs"]


@dataclass(frozen=True, eq=False)
class JudgedModel:
    """A model that was judged on the held-out experiments.

    Attributes:
        label: what it is, such as "known" or "with coulomb_friction at rail".
        system: with its numbers, ready to be written as a file.
        logs: all experiments, with the states and constants of `system`.
        gap: on the held-out experiments.
    """

    label: str
    system: System
    logs: Logs
    gap: Gap


@dataclass(frozen=True)
class Estimate:
    """A number of the augmented model: `known` in the file that was given (nan of an effect), and identified
    with its 95 % interval; SI.
    """

    unit: str
    known: float
    value: float
    interval: Interval


@dataclass(frozen=True, eq=False)
class DiagnosedEffect:
    """A diagnosed effect.

    Attributes:
        added: the effect and where it acts; its law is in names of `added.system`.
        estimates: by name, those numbers of the law that were fitted, see `Added.reported`. own: of each of
            the amplitudes that differ from experiment to experiment, the values by id.
        confidence: that it is this one or one of `indistinguishable`, from 0 to 1.
        shrink: how far the gap shrinks by it, by the definition of the contract.
        indistinguishable: what these data cannot tell from it.
    """

    added: Added
    estimates: Mapping[str, Estimate]
    own: Mapping[str, Mapping[str, float]]
    confidence: float
    shrink: float
    indistinguishable: tuple[Added, ...]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model that was fitted: its effects, its gap on the training experiments, and its evidence.

    The evidence is by how much its loss, in natural logarithms of a likelihood, is worse than that of the
    best one, complexity counted in; 0 for the best.
    """

    effects: tuple[Added, ...]
    gap: float
    evidence: float


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The gap between a system and measured experiments, explained (shared/contracts/diagnosis.md).

    Attributes:
        system, logs: as they were given. horizon: of the free-run windows, s. seed: of everything drawn.
        verdict: what was found. confidence: in the verdict and its effects, calibrated.
        effects: the strongest first. partial: they explain only part of the gap (verdict unknown).
        known, reidentified, augmented, neural: the models of the contract. Without an effect `augmented` is
            `reidentified`.
        steps: from `reidentified`, an effect more each, to `augmented`.
        floor: of the gap on the held-out experiments. shrink, interval: of the contract.
        held_out: numbers of the experiments that took no part in fitting or choosing.
        parameters: the uncertain parameters of the system by name.
        candidates: all models that were fitted in the end, the best first.
        notes: what a reader must know. signs: what the confidence comes from, see `confidence.Signs`.
        faults: of the logs; with the verdict check_logs they are the answer, nothing was fitted, and all
            models are the known one.
    """

    system: System
    logs: Logs
    horizon: float
    seed: int
    verdict: Verdict
    confidence: float
    effects: tuple[DiagnosedEffect, ...]
    partial: bool
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
    candidates: tuple[Candidate, ...]
    notes: tuple[str, ...]
    signs: Mapping[str, float] = field(default_factory=dict)
    faults: tuple[LogFault, ...] = ()


@dataclass(frozen=True)
class LogFault:
    """A fault of the logs.

    Attributes:
        channels: names of the outputs and inputs that have it, `t` for time, `experiments` for whole logs.
        problem: its name, such as "degrees" or "sign". explains: share of the mean square error of the known
            physics that its correction takes away; None where it is not about the error.
        experiments: ids of those that have it; () for all.
        sentence: what is seen, and what to do.
        decides: whether it is the answer to a diagnosis.
        indistinguishable: channels and problem of other faults that explain as much.
    """

    channels: tuple[str, ...]
    problem: str
    explains: float | None
    experiments: tuple[str, ...]
    sentence: str
    decides: bool
    indistinguishable: tuple[tuple[tuple[str, ...], str], ...] = ()
