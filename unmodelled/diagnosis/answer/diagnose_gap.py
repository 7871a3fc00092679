"""Diagnosis of the gap between a system and measured experiments (shared/contracts/diagnosis.md)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.answer.confirmed import confirmed
from unmodelled.diagnosis.data.duplicates import different
from unmodelled.diagnosis.data.gap import shrink
from unmodelled.diagnosis.data.result import (
    Compared,
    DiagnosedEffect,
    Diagnosis,
    Estimate,
    Interval,
    JudgedModel,
    LogFault,
)
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.decide.confidence import HIGHEST_CONFIDENCE, confidence
from unmodelled.diagnosis.decide.decision import Decision, decide
from unmodelled.diagnosis.decide.undetermined import is_determined, remarks
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.jackknife import interval
from unmodelled.diagnosis.fitting.judged_models import judged_model, known_model, values_per_experiment
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.log_faults import without_copies
from unmodelled.effects.added import Added
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Array = NDArray[np.float64]

#: Draws of the bootstrap.
DRAWS = 2000
#: Candidates that are listed, and at least so many of them with further effects.
LISTED, LARGER = 20, 5


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
        faults: faults of the logs, computed by `without_copies` unless given. A fault that decides is the
            answer; of identical experiments the first one is used.
        thresholds: thresholds of all decisions.

    Returns:
        The diagnosis: verdict, effects, judged models, comparison and notes.
    """
    if faults is None:
        system, logs, faults = without_copies(system, logs, horizon, thresholds)
    if any(fault.decides for fault in faults):
        return _misread(Study.of(system, logs, horizon, seed, thresholds), seed, faults)
    study = Study.of(system, different(logs), horizon, seed, thresholds)
    named = confirmed(study, workers, progress)
    search, chosen = named.search, named.chosen
    path = _path(search, chosen)
    steps = [
        named.reidentified,
        *(judged_model(f"with {e.family} at {e.place.channel}", f) for e, f in path),
    ]
    network, flexible = search.beside_network(chosen)
    candidates = search.candidates
    decision = decide(candidates, candidates.fits.index(chosen), flexible, steps[-1].gap)
    models = [known_model(study), *steps, judged_model("neural", network)]
    found = _told(search.study, decision, models, [effect for effect, _ in path], faults, seed)
    return replace(found, notes=(*found.notes, *named.notes))


def _path(search: EffectSearch, chosen: FittedHypothesis) -> list[tuple[Added, FittedHypothesis]]:
    """Effects of `chosen`, the one that it can least do without first, and fits with it and earlier ones."""
    path: list[tuple[Added, FittedHypothesis]] = []
    whole = {effect.key: effect for effect in chosen.hypothesis.effects}
    without = {e.key: search.without(chosen, e).hypothesis.key for e in chosen.hypothesis.removable}
    left = {key: float(search.found[fewer].score().mean()) for key, fewer in without.items()}
    while effects := chosen.hypothesis.removable:
        weakest = min(effects, key=lambda effect: left.get(effect.key, np.inf))
        # with fewer effects, the numbers of an effect may have other names
        path.insert(0, (whole[weakest.key], chosen))
        chosen = search.without(chosen, weakest)
    return path


def _told(
    study: Study,
    decision: Decision,
    models: Sequence[JudgedModel],
    order: Sequence[Added],
    faults: tuple[LogFault, ...],
    seed: int,
) -> Diagnosis:
    """The diagnosis of a decision; `models`: as given, re-identified, with one effect more each, neural."""
    given, *steps, neural = models
    reidentified, augmented = steps[0], steps[-1]
    named, floor = int(decision.candidates.steps[decision.named]), augmented.gap.floor
    sure = confidence(decision.verdict, named)
    return Diagnosis(
        *(study.system, study.logs, study.horizon, seed, decision.verdict),
        confidence=sure,
        effects=_effects(decision, order, steps, sure, seed),
        remainder=decision.remainder,
        known=given,
        reidentified=reidentified,
        augmented=augmented,
        neural=neural,
        steps=tuple(steps),
        floor=floor,
        shrink=shrink(reidentified.gap.value, augmented.gap.value, floor),
        interval=_interval(steps, 0, len(steps) - 1, seed),
        held_out=study.held_out,
        parameters={
            p.name: _estimate(decision, p.name, p.unit, p.value)
            for p in study.system.parameters
            if p.name in study.system.uncertain
        },
        comparison=_compared(decision),
        notes=(*_notes(study, decision), *_about(given), *_about(augmented)),
        faults=faults,
    )


def _share(squares: Array, floor: float, before: int, after: int) -> Array:
    """Share of the squared gap above the floor that `after` removes; squares, shape (steps, ...)."""
    whole = squares[0] - floor**2
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(whole > 0.0, (squares[before] - squares[after]) / whole, 0.0)
    return np.clip(found, 0.0, 1.0)


def _interval(steps: Sequence[JudgedModel], before: int, after: int, seed: int) -> Interval:
    """95 % interval of the share that models from `before` to `after` explain: bootstrap over experiments."""
    ids = list(steps[0].gap.per_experiment)
    squares = np.array([[step.gap.per_experiment[i] ** 2 for i in ids] for step in steps])
    drawn = np.random.default_rng([seed, 2]).integers(0, len(ids), (DRAWS, len(ids)))
    shares = _share(squares[:, drawn].mean(2), steps[-1].gap.floor, before, after)
    low, high = np.quantile(shares, [0.025, 0.975]).tolist()
    return low, high


def _effects(
    decision: Decision, order: Sequence[Added], steps: Sequence[JudgedModel], sure: float, seed: int
) -> tuple[DiagnosedEffect, ...]:
    """Effects in `order` with their shares of the gap; `steps`: without effects, then one more each."""
    own = values_per_experiment(decision.prediction.fitted)
    squares = np.array([step.gap.value**2 for step in steps])
    found = []
    for k, effect in enumerate(order):
        estimates = {
            n: _estimate(decision, n, effect.units[n], np.nan) for n in effect.reported if n not in own
        }
        share = float(_share(squares, steps[-1].gap.floor, k, k + 1))
        others = decision.indistinguishable[decision.prediction.fitted.hypothesis.effects.index(effect)]
        mine = {n: own[n] for n in effect.per_experiment}
        chance = _interval(steps, k, k + 1, seed)
        found.append(DiagnosedEffect(effect, estimates, mine, sure, share, chance, others))
    return tuple(found)


def _estimate(decision: Decision, name: str, unit: str, known: float) -> Estimate:
    """A fitted number with its interval, or one of the system file."""
    fitted = decision.prediction.fitted
    if name in fitted.fit.values:
        level = fitted.hypothesis.study.thresholds.level
        ends = interval(decision.prediction, name, level, decision.alike)
        doubts = is_determined(fitted, name), fitted.at_bound(name)
        return Estimate(unit, known, fitted.fit.values[name], ends, *doubts)
    full = fitted.hypothesis.full
    value = dict(zip((p.name for p in full.parameters), full.values, strict=True))[name]
    return Estimate(unit, known, value, (value, value))


def _compared(decision: Decision) -> tuple[Compared, ...]:
    """The named candidate, the best others, and some that add effects to it, which say less."""
    candidates, named = decision.candidates, decision.named
    scores, keys = candidates.scores.mean(1), [f.hypothesis.key for f in candidates.fits]
    others = [k for k in np.argsort(scores, kind="stable").tolist() if k != named]
    larger = [k for k in others if keys[named] < keys[k]]
    rest = [k for k in others if k not in larger]
    listed = [named, *larger[:LARGER], *rest, *larger[LARGER:]][:LISTED]
    found = []
    for k in sorted(listed, key=lambda k: float(scores[k])):
        worse = candidates.gain(k, named)
        effects = candidates.fits[k].hypothesis.effects
        found.append(Compared(effects, float(scores[k]), worse.mean, worse.error, k == named))
    return tuple(found)


def _about(model: JudgedModel) -> tuple[str, ...]:
    """Notes on the gap of a model."""
    return tuple(f"{model.label}: {note}" for note in model.gap.notes)


def _notes(study: Study, decision: Decision) -> tuple[str, ...]:
    """Notes on logs, timing, numbers of single experiments, and doubtful numbers."""
    notes, period, chosen = list(study.logs.notes), study.logs.period, decision.prediction.fitted
    held = [item.name for item in chosen.hypothesis.system.inputs if item.hold]
    if held:
        notes.append(f"inputs keep their values between samples (hold: true): {', '.join(held)}")
    for name, item in chosen.hypothesis.timing.items():
        late = chosen.fit.values[name]
        if abs(late) > max(0.1 * period, 2.0 * chosen.fit.variance(name) ** 0.5):
            most = "at least " if chosen.at_bound(name) else ""
            notes.append(
                f"input {item} acts {most}{abs(late):.2g} s {'later' if late > 0.0 else 'earlier'} than "
                f"logged ({abs(late) / period:.2g} sampling periods; zero-order hold alone is half of one): "
                "this is not reported as a delay; give a known delay in the system file"
            )
    if chosen.fit.own:
        notes.append(
            f"{', '.join(chosen.fit.own)}: fitted per experiment, to the first half of held-out and new ones"
        )
    notes += [remark.sentence for remark in remarks(decision.prediction, decision.alike)]
    return tuple(notes)


def _misread(study: Study, seed: int, faults: Sequence[LogFault]) -> Diagnosis:
    """Answer with the faults of the logs; nothing is searched and nothing fitted.

    The confidence is the share of the gap that the fault explains, divided among it and the laws that explain
    as much, and full where logs are identical.

    Args:
        study: the known physics and the logs as read.
        seed: seed of the held-out experiments.
        faults: faults of the logs, of which at least one decides.
    """
    known = known_model(study)
    deciding = [fault for fault in faults if fault.decides and fault.explains is not None]
    shares = [(fault.explains or 0.0) / (1 + fault.rivals) for fault in deciding]
    return Diagnosis(
        *(study.system, study.logs, study.horizon, seed, "check_logs"),
        confidence=min([HIGHEST_CONFIDENCE, *shares]),
        effects=(),
        remainder=None,
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
        comparison=(),
        notes=study.logs.notes,
        faults=tuple(faults),
    )
