"""The parts of a diagnosis: effects with their numbers and shares, comparison, and notes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from unmodelled.diagnosis.answer.shares import share_interval, shares
from unmodelled.diagnosis.data.gap import shrink
from unmodelled.diagnosis.data.remark import Remark
from unmodelled.diagnosis.data.result import (
    Compared,
    DiagnosedEffect,
    Diagnosis,
    Estimate,
    JudgedModel,
    LogFault,
)
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.decide.confidence import HIGHEST_CONFIDENCE, confidence
from unmodelled.diagnosis.decide.decision import Decision
from unmodelled.diagnosis.decide.undetermined import is_determined, remarks
from unmodelled.diagnosis.decide.usual_mistakes import usual_mistake
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.jackknife import covariance, interval
from unmodelled.diagnosis.fitting.judged_models import known_model, values_per_experiment
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.effects.added import Added

#: Candidates that are listed, and at least so many of them with further effects.
LISTED, LARGER = 20, 5


def steps_to(search: EffectSearch, chosen: FittedHypothesis) -> list[tuple[Added, FittedHypothesis]]:
    """Return effects, the one that can least be done without first, and fits with it and earlier ones."""
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


def assembled(
    search: EffectSearch,
    decision: Decision,
    models: Sequence[JudgedModel],
    order: Sequence[Added],
    faults: tuple[LogFault, ...],
    seed: int,
) -> Diagnosis:
    """Return the diagnosis of a decision."""
    study, (given, *steps, neural) = search.study, models
    reidentified, augmented = steps[0], steps[-1]
    named, floor = int(decision.candidates.steps[decision.named]), augmented.gap.floor
    explained = shrink(reidentified.gap.value, augmented.gap.value, floor)
    sure = confidence(decision.verdict, named, explained)
    doubts = remarks(decision.prediction, decision.alike)
    return Diagnosis(
        *(study.system, study.logs, study.horizon, seed, decision.verdict),
        confidence=sure,
        chance=search.chance,
        effects=_effects(decision, order, steps, sure, seed, doubts),
        remainder=decision.remainder,
        known=given,
        reidentified=reidentified,
        augmented=augmented,
        neural=neural,
        steps=tuple(steps),
        floor=floor,
        shrink=explained,
        interval=share_interval(steps, 0, len(steps) - 1, seed),
        held_out=study.held_out,
        parameters={
            p.name: _estimate(decision, p.name, p.unit, p.value, doubts)
            for p in study.system.parameters
            if p.name in study.system.uncertain
        },
        comparison=_compared(decision),
        notes=(*_notes(study, decision, doubts), *_about(given), *_about(augmented)),
        faults=faults,
        correlations=_correlations(decision.prediction),
    )


def _correlations(prediction: LeftOut) -> dict[tuple[str, str], float]:
    """Correlations of the shared numbers, those of effects first; none where fewer than two scatter."""
    fitted = prediction.fitted
    own = {name for effect in fitted.hypothesis.effects for name in effect.reported}
    shared = [u.name for u in fitted.unknowns.each if not u.own and not u.start]
    wanted = [n for n in shared if n in own or n in fitted.hypothesis.study.system.uncertain]
    names = sorted(wanted, key=lambda name: name not in own)
    spread = covariance(prediction, names)
    scattered = [(k, name) for k, name in enumerate(names) if spread[k, k] > 0.0]
    if len(scattered) < 2:
        return {}
    scale = np.sqrt(np.diag(spread))
    pairs = product(scattered, scattered)
    return {
        (a, b): float(np.clip(spread[i, k] / (scale[i] * scale[k]), -1.0, 1.0)) for (i, a), (k, b) in pairs
    }


def _effects(
    decision: Decision,
    order: Sequence[Added],
    steps: Sequence[JudgedModel],
    sure: float,
    seed: int,
    doubts: Sequence[Remark],
) -> tuple[DiagnosedEffect, ...]:
    """Effects with their shares of the gap, the largest first; `steps`: without effects, then in `order`.

    The first effects in `order` can least be done without, and still may lower the error hardly by
    themselves: these are told with the later ones with which they do.
    """
    own = values_per_experiment(decision.prediction.fitted)
    material = decision.candidates.thresholds.material_shrink
    squares = np.array([step.gap.value**2 for step in steps])
    parts = [float(shares(squares, steps[-1].gap.floor, k, k + 1)) for k in range(len(order))]
    found = []
    for k, effect in enumerate(order):
        estimates = {
            n: _estimate(decision, n, effect.units[n], np.nan, doubts)
            for n in effect.reported
            if n not in own
        }
        joint = [order[j] for j in needed(parts, k, material)]
        others = decision.indistinguishable[decision.prediction.fitted.hypothesis.effects.index(effect)]
        mine = {n: own[n] for n in effect.per_experiment}
        chance = share_interval(steps, k, k + 1, seed)
        known = DiagnosedEffect(effect, estimates, mine, sure, parts[k], chance, others)
        found.append(replace(known, only_with=tuple(joint), step=k))
    return tuple(sorted(found, key=lambda effect: -effect.shrink))


def needed(shares: Sequence[float], k: int, material: float) -> list[int]:
    """Return the later effects without which effect `k` lowers the error by less than a material share.

    Shares are those of the effects one after the other, each of what the earlier ones leave.

    Examples:
        >>> needed([0.0, 0.9, 0.01], 0, 0.2), needed([0.9, 0.01], 0, 0.2), needed([0.9, 0.01], 1, 0.2)
        ([1, 2], [], [])
    """
    return [j for j in range(k + 1, len(shares)) if shares[k] < min(material, shares[j])]


def _estimate(decision: Decision, name: str, unit: str, known: float, doubts: Sequence[Remark]) -> Estimate:
    """A fitted number with its interval, or one of the system file."""
    fitted = decision.prediction.fitted
    if name in fitted.fit.values:
        level = fitted.hypothesis.study.thresholds.level
        ends = interval(decision.prediction, name, level, decision.alike)
        flags = is_determined(fitted, name), fitted.at_bound(name)
        kinds = tuple(dict.fromkeys(doubt.kind for doubt in doubts if name in doubt.numbers))
        return Estimate(unit, known, fitted.fit.values[name], ends, *flags, kinds)
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


def _notes(study: Study, decision: Decision, doubts: Sequence[Remark]) -> tuple[str, ...]:
    """Notes on logs, timing, numbers of single experiments, and doubtful numbers."""
    notes, chosen = list(study.logs.notes), decision.prediction.fitted
    held = [item.name for item in chosen.hypothesis.system.inputs if item.hold]
    if held:
        notes.append(f"inputs keep their values between samples (hold: true): {', '.join(held)}")
    for name, item in chosen.hypothesis.timing.items():
        late, period = chosen.fit.values[name], study.input_periods[item]
        if abs(late) > max(0.1 * period, 2.0 * chosen.fit.variance(name) ** 0.5):
            most = "at least " if chosen.at_bound(name) else ""
            notes.append(
                f"input {item} acts {most}{abs(late):.2g} s {'later' if late > 0.0 else 'earlier'} than "
                f"logged ({abs(late) / period:.2g} of its sampling periods; zero-order hold alone is half of "
                "one): this is not reported as a delay; give a known delay in the system file"
            )
    if chosen.fit.own:
        notes.append(
            f"{', '.join(chosen.fit.own)}: fitted per experiment, to the first half of held-out and new ones"
        )
    known = {p.name: p for p in study.system.parameters}
    for name, error in ((e.place.name, *e.amplitudes) for e in chosen.hypothesis.effects if e.is_other_value):
        if not any(error in doubt.numbers for doubt in doubts):
            notes.append(usual_mistake(known[name], known[name].value + chosen.fit.values[error]))
    notes += [doubt.sentence for doubt in doubts]
    return tuple(filter(None, notes))


def misread(study: Study, seed: int, faults: Sequence[LogFault]) -> Diagnosis:
    """Return the answer with the faults of the logs, as sure as they explain the gap; nothing is fitted."""
    known = known_model(study)
    shares = [f.explains for f in faults if f.decides and f.explains is not None]
    return Diagnosis(
        *(study.system, study.logs, study.horizon, seed, "check_logs"),
        confidence=min([HIGHEST_CONFIDENCE, *shares]),
        chance=None,
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
