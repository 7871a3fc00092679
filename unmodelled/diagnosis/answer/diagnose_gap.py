"""Diagnosis of the gap between a system and measured experiments (shared/contracts/diagnosis.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.duplicates import different
from unmodelled.diagnosis.data.gap import shrink
from unmodelled.diagnosis.data.result import (
    Candidate,
    DiagnosedEffect,
    Diagnosis,
    Estimate,
    Interval,
    JudgedModel,
    LogFault,
)
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.decide.confidence import HIGHEST_CONFIDENCE, Signs, confidence
from unmodelled.diagnosis.decide.decision import Decision, decide
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model, known_model, values_per_experiment
from unmodelled.diagnosis.search.candidates import Candidates, noise_ratio
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.log_faults import log_faults
from unmodelled.diagnosis.search.network import fit_network
from unmodelled.effects.added import Added
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Array = NDArray[np.float64]

#: Two-sided quantile of an interval of 95 %, and draws of the bootstrap.
Z, DRAWS = 1.96, 2000
#: Candidates that are listed.
LISTED = 20


def diagnose_gap(
    system: System,
    logs: Logs,
    horizon: float,
    seed: int,
    workers: int = 2,
    progress: Callable[[str], None] = lambda _: None,
    faults: tuple[LogFault, ...] | None = None,
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
) -> Diagnosis:
    """Find the effects that explain the gap between a system and measured experiments.

    A share of the experiments is held out from fitting and choosing; gaps are computed on these.

    Args:
        system: the known physics.
        logs: two or more experiments, with the states of `system`.
        horizon: length of the free-run windows, s.
        seed: seed of the held-out experiments, the network and the bootstrap.
        workers: number of threads, default 2.
        progress: function that is called with a line of text at each step.
        faults: faults of the logs, computed by `log_faults` unless given. A fault that decides is the answer;
            of identical experiments the first one is used.
        thresholds: thresholds of all decisions.

    Returns:
        The diagnosis: verdict, effects, judged models, candidates and notes.
    """
    faults = log_faults(system, logs, horizon, thresholds) if faults is None else faults
    if any(fault.decides for fault in faults):
        return _misread(Study.of(system, logs, horizon, seed, thresholds), seed, faults)
    logs = different(logs)
    study = Study.of(system, logs, horizon, seed, thresholds)
    search = EffectSearch(study, workers, progress)
    candidates = search.run()
    decision = decide(candidates)
    chosen = candidates.fits[decision.named]
    progress("judge the models on the held-out experiments")
    given, reidentified = known_model(study), judged_model("re-identified", search.base)
    path = _path(search, chosen)
    steps = [reidentified, *(judged_model(f"with {e.family} at {e.place.channel}", f) for e, f in path)]
    progress("fit a network in every port")
    neural = judged_model("neural", fit_network(search.base, search.fitted, search.screened, seed))
    verdict = decision.verdict
    augmented, signs = steps[-1], Signs.of(candidates, decision)
    sure = confidence(verdict, signs)
    floor = augmented.gap.floor
    return Diagnosis(
        *(system, logs, horizon, seed, verdict),
        confidence=sure,
        effects=_effects(candidates, decision, [effect for effect, _ in path], steps, sure),
        partial=verdict == "unknown" and bool(path),
        known=given,
        reidentified=reidentified,
        augmented=augmented,
        neural=neural,
        steps=tuple(steps),
        floor=floor,
        shrink=shrink(reidentified.gap.value, augmented.gap.value, floor),
        interval=_interval(reidentified, augmented, floor, seed),
        held_out=study.held_out,
        parameters=_parameters(system, chosen),
        candidates=_listed(candidates),
        notes=(*_notes(study, chosen), *_about(given), *_about(augmented)),
        signs=asdict(signs),
        faults=faults,
    )


def _path(search: EffectSearch, chosen: FittedHypothesis) -> list[tuple[Added, FittedHypothesis]]:
    """Effects of `chosen` in the order in which they lower the loss, and fits with these and earlier ones."""
    left, path = list(chosen.hypothesis.effects), list[tuple[Added, FittedHypothesis]]()
    while len(left) > 1:
        before = path[-1][1].hypothesis if path else search.base.hypothesis
        tries = [search.fitted_with(before, effect) for effect in left]
        best = int(np.argmin(Candidates((search.base, *tries)).losses[1:].sum(1)))
        path.append((left.pop(best), tries[best]))
    return [*path, *((effect, chosen) for effect in left)]


def _interval(before: JudgedModel, after: JudgedModel, floor: float, seed: int) -> Interval:
    """95 % interval of the shrink, by the bootstrap over held-out experiments."""
    ids = list(before.gap.per_experiment)
    squares = (np.array([m.gap.per_experiment[i] ** 2 for i in ids]) for m in (before, after))
    drawn = np.random.default_rng([seed, 2]).integers(0, len(ids), (DRAWS, len(ids)))
    old, new = (np.sqrt(square[drawn].mean(1)).tolist() for square in squares)
    shares = [shrink(o, n, floor) for o, n in zip(old, new, strict=True)]
    low, high = np.quantile(shares, [0.025, 0.975]).tolist()
    return low, high


def _effects(
    candidates: Candidates,
    decision: Decision,
    order: Sequence[Added],
    steps: Sequence[JudgedModel],
    sure: float,
) -> tuple[DiagnosedEffect, ...]:
    """Effects in `order` with their shares of the gap; `steps`: without effects, then one more each."""
    chosen, floor = candidates.fits[decision.named], steps[-1].gap.floor
    own = values_per_experiment(chosen)
    squares = [step.gap.value**2 for step in steps]
    whole = squares[0] - floor**2
    found = []
    for k, effect in enumerate(order):
        estimates = {
            n: _estimate(chosen, n, effect.units[n], np.nan) for n in effect.reported if n not in own
        }
        share = float(np.clip((squares[k] - squares[k + 1]) / whole, 0.0, 1.0)) if whole > 0.0 else 0.0
        others = decision.indistinguishable[chosen.hypothesis.effects.index(effect)]
        mine = {n: own[n] for n in effect.per_experiment}
        found.append(DiagnosedEffect(effect, estimates, mine, sure, share, others))
    return tuple(found)


def _estimate(fitted: FittedHypothesis, name: str, unit: str, known: float) -> Estimate:
    """A fitted number, or one of the system file, with its interval cut at the bounds."""
    fit = fitted.fit
    if name not in fit.values:
        value = dict(
            zip(
                (p.name for p in fitted.hypothesis.full.parameters),
                fitted.hypothesis.full.values,
                strict=True,
            )
        )[name]
        return Estimate(unit, known, value, (value, value))
    value = fit.values[name]
    k = fit.names.index(name)
    reach = Z * float(np.sqrt(fit.covariance[k, k]))
    (unknown,) = (u for u in fitted.hypothesis.unknowns if u.name == name)
    return Estimate(unit, known, value, (max(value - reach, unknown.low), min(value + reach, unknown.high)))


def _parameters(system: System, fitted: FittedHypothesis) -> Mapping[str, Estimate]:
    return {p.name: _estimate(fitted, p.name, p.unit, p.value) for p in system.parameters if p.identify}


def _listed(candidates: Candidates) -> tuple[Candidate, ...]:
    order = np.argsort(candidates.penalised, kind="stable").tolist()[:LISTED]
    best = float(candidates.penalised[order[0]])
    return tuple(
        Candidate(
            candidates.fits[k].hypothesis.effects,
            candidates.fits[k].fit.gap.value,
            best - float(candidates.penalised[k]),
        )
        for k in order
    )


def _about(model: JudgedModel) -> tuple[str, ...]:
    """Notes on the gap of a model."""
    return tuple(f"{model.label}: {note}" for note in model.gap.notes)


def _notes(study: Study, chosen: FittedHypothesis) -> tuple[str, ...]:
    """Notes on logs, timing, numbers of single experiments and remaining errors."""
    notes, period = list(study.logs.notes), study.logs.period
    for name, item in chosen.hypothesis.timing.items():
        late = chosen.fit.values[name]
        if abs(late) > 0.1 * period:
            notes.append(
                f"input {item} acts {abs(late):.2g} s {'later' if late > 0.0 else 'earlier'} than logged "
                f"({abs(late) / period:.2g} sampling periods; zero-order hold alone is half of one): this "
                "is not reported as a delay; give a known delay in the system file"
            )
    if chosen.fit.own:
        notes.append(
            f"{', '.join(chosen.fit.own)}: fitted per experiment, for held-out experiments too; for a new "
            "experiment give its own value"
        )
    left = noise_ratio(chosen)
    if chosen.hypothesis.effects and left > study.thresholds.at_floor:
        notes.append(
            f"the remaining mean square error is {1.0 + left:.3g} times the variance of the sensor noise: a "
            "further effect may be missing, see in index.html where the gap lies"
        )
    return tuple(notes)


def _misread(study: Study, seed: int, faults: Sequence[LogFault]) -> Diagnosis:
    """Answer with the faults of the logs; nothing is searched and nothing fitted.

    The confidence is the share of the gap that the fault explains, and full where logs are identical.

    Args:
        study: the known physics and the logs as read.
        seed: seed of the held-out experiments.
        faults: faults of the logs, of which at least one decides.
    """
    known = known_model(study)
    shares = [fault.explains for fault in faults if fault.decides and fault.explains is not None]
    return Diagnosis(
        *(study.system, study.logs, study.horizon, seed, "check_logs"),
        confidence=min([HIGHEST_CONFIDENCE, *shares]),
        effects=(),
        partial=False,
        known=known,
        reidentified=known,
        augmented=known,
        neural=known,
        steps=(known,),
        floor=known.gap.floor,
        shrink=0.0,
        interval=(0.0, 0.0),
        held_out=study.held_out,
        parameters={},
        candidates=(),
        notes=study.logs.notes,
        faults=tuple(faults),
    )
