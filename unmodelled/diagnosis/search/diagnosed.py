"""The diagnosis of the gap between a system and measured experiments (shared/contracts/diagnosis.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.diagnosis import (
    Candidate,
    Diagnosis,
    Estimate,
    Found,
    Interval,
    Model,
    Verdict,
)
from unmodelled.diagnosis.data.duplicates import different
from unmodelled.diagnosis.data.log_fault import LogFault
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting import models
from unmodelled.diagnosis.fitting.fitted import Fitted
from unmodelled.diagnosis.search.choose import AT_FLOOR, Scores, above_floor, explained
from unmodelled.diagnosis.search.confidence import Signs, confidence
from unmodelled.diagnosis.search.log_faults import log_faults
from unmodelled.diagnosis.search.misread import misread
from unmodelled.diagnosis.search.network import network
from unmodelled.diagnosis.search.search import Search
from unmodelled.effects.added import Added
from unmodelled.evaluation.gap import shrink
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

Array = NDArray[np.float64]

#: Two-sided quantile of an interval of 95 %, and draws of the bootstrap.
Z, DRAWS = 1.96, 2000
#: Models that are listed.
LISTED = 20


def diagnosed(
    system: System,
    logs: Logs,
    horizon: float,
    seed: int,
    workers: int = 2,
    progress: Callable[[str], None] = lambda _: None,
    faults: tuple[LogFault, ...] | None = None,
) -> Diagnosis:
    """Say where the gap lies, which effects cause it, and how far it shrinks once they are added.

    A quarter of the experiments, drawn with `seed`, takes no part in fitting or choosing; gaps are theirs.

    Args:
        system: the known physics. logs: at least two experiments, with the states of `system`.
        horizon: of the free-run windows, s. seed: of the held-out experiments, the network and the bootstrap.
        workers: threads. progress: is told what is being done.
        faults: of the logs, see `log_faults`; asked for unless given. One that decides is the answer; of
            identical experiments the first one counts.
    """
    faults = log_faults(system, logs, horizon) if faults is None else faults
    if any(fault.decides for fault in faults):
        return misread(Study.of(system, logs, horizon, seed), seed, faults)
    logs = different(logs)
    study = Study.of(system, logs, horizon, seed)
    search = Search(study, workers, progress)
    scores = search.run()
    named = scores.named()
    chosen = scores.fits[named]
    progress("judge the models on the held-out experiments")
    given, reidentified = models.known(study), models.model("re-identified", search.base)
    path = _path(search, chosen)
    steps = [reidentified, *(models.model(f"with {e.family} at {e.place.channel}", f) for e, f in path)]
    progress("fit a network in every port")
    neural = models.model("neural", network(search.base, search.fitted, search.screened, seed))
    verdict: Verdict = "effect" if chosen.hypothesis.effects else "no_gap"
    if not explained(search.base, chosen):
        verdict = "unknown"
    augmented, signs = steps[-1], Signs.of(scores, named)
    sure = confidence(verdict, signs)
    floor = augmented.gap.floor
    return Diagnosis(
        *(system, logs, horizon, seed, verdict),
        confidence=sure,
        effects=_effects(scores, named, [effect for effect, _ in path], steps, floor, sure),
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
        candidates=_candidates(scores),
        notes=(*_notes(study, chosen), *_about(given), *_about(augmented)),
        signs=asdict(signs),
        faults=faults,
    )


def _path(search: Search, chosen: Fitted) -> list[tuple[Added, Fitted]]:
    """Effects of `chosen`, that which lowers the loss most first, and fits with it and those before it."""
    left, path = list(chosen.hypothesis.effects), list[tuple[Added, Fitted]]()
    while len(left) > 1:
        before = path[-1][1].hypothesis if path else search.base.hypothesis
        tries = [search.fitted_with(before, effect) for effect in left]
        best = int(np.argmin(Scores((search.base, *tries)).losses[1:].sum(1)))
        path.append((left.pop(best), tries[best]))
    return [*path, *((effect, chosen) for effect in left)]


def _interval(before: Model, after: Model, floor: float, seed: int) -> Interval:
    """95 % of the shrink, over the held-out experiments drawn again and again."""
    ids = list(before.gap.per_experiment)
    squares = (np.array([m.gap.per_experiment[i] ** 2 for i in ids]) for m in (before, after))
    drawn = np.random.default_rng([seed, 2]).integers(0, len(ids), (DRAWS, len(ids)))
    old, new = (np.sqrt(square[drawn].mean(1)).tolist() for square in squares)
    shares = [shrink(o, n, floor) for o, n in zip(old, new, strict=True)]
    low, high = np.quantile(shares, [0.025, 0.975]).tolist()
    return low, high


def _effects(
    scores: Scores, named: int, order: Sequence[Added], steps: Sequence[Model], floor: float, sure: float
) -> tuple[Found, ...]:
    chosen = scores.fits[named]
    alike = scores.alike(named)
    own = models.own_values(chosen)
    squares = [step.gap.value**2 for step in steps]
    whole = squares[0] - floor**2
    found = []
    for k, effect in enumerate(order):
        estimates = {
            n: _estimate(chosen, n, effect.units[n], np.nan) for n in effect.reported if n not in own
        }
        share = float(np.clip((squares[k] - squares[k + 1]) / whole, 0.0, 1.0)) if whole > 0.0 else 0.0
        others = alike[chosen.hypothesis.effects.index(effect)]
        mine = {n: own[n] for n in effect.per_experiment}
        found.append(Found(effect, estimates, mine, sure, share, others))
    return tuple(found)


def _estimate(fitted: Fitted, name: str, unit: str, known: float) -> Estimate:
    """What was fitted, or stands in the system, with an interval that its bounds cut."""
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


def _parameters(system: System, fitted: Fitted) -> Mapping[str, Estimate]:
    return {p.name: _estimate(fitted, p.name, p.unit, p.value) for p in system.parameters if p.identify}


def _candidates(scores: Scores) -> tuple[Candidate, ...]:
    order = np.argsort(scores.total, kind="stable").tolist()[:LISTED]
    best = float(scores.total[order[0]])
    return tuple(
        Candidate(
            scores.fits[k].hypothesis.effects, scores.fits[k].fit.gap.value, best - float(scores.total[k])
        )
        for k in order
    )


def _about(model: Model) -> tuple[str, ...]:
    """What a reader of the gap of a model must know."""
    return tuple(f"{model.label}: {note}" for note in model.gap.notes)


def _notes(study: Study, chosen: Fitted) -> tuple[str, ...]:
    """What a reader must know beside the numbers."""
    notes = list(study.logs.notes)
    for name, item in chosen.hypothesis.timing.items():
        late = chosen.fit.values[name]
        if abs(late) > 0.1 * study.logs.period:
            word = "after" if late > 0.0 else "before"
            notes.append(
                f"input {item} acts {abs(late):.2g} s {word} it is logged: holding, not counted as a delay"
            )
    if chosen.fit.own:
        notes.append(
            f"{', '.join(chosen.fit.own)}: one number per experiment; those of held-out experiments come "
            "from these experiments themselves, with all else as it was"
        )
    left = above_floor(chosen)
    if chosen.hypothesis.effects and left > AT_FLOOR:
        notes.append(
            f"something is left: the mean square error is {1.0 + left:.3g} times that of the sensors' noise"
        )
    return tuple(notes)
