"""What a search has found, without effects that explain next to nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from unmodelled.diagnosis.answer.sentences import named
from unmodelled.diagnosis.data.gap import Gap
from unmodelled.diagnosis.data.remark import listed, quantity
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.decide.decision import equals, is_confirmed
from unmodelled.diagnosis.decide.undetermined import doubtful
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.judged_models import gap_of_all_runs, judged_model
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.input_hold import begun
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.opposite import (
    MOST_BETWEEN,
    Pairs,
    comparable_ports,
    opposite_ports,
    with_ports_between,
)
from unmodelled.effects.added import Added

#: Share that equal and opposite efforts beside named effects may leave of what only two efforts explain: the
#: named effects leave errors of their own.
BESIDE = 0.5
#: Share of the squared error of all experiments without an effect, in the output where it is largest, that
#: the effect removes at least: a twentieth is less than what any repeat of the experiments varies. Little
#: beside a far larger effect may still be all of the rest: dry friction beside gravity.
SMALLEST_SHARE = 0.05


@dataclass(frozen=True, eq=False)
class Confirmed:
    """A hypothesis that predicts left-out experiments best; held-out experiments may doubt it."""

    search: EffectSearch
    chosen: FittedHypothesis  # hypothesis to name; without effects if none explains enough
    reidentified: JudgedModel  # the physics without effects, judged on the held-out experiments
    best: FittedHypothesis  # the simplest that none beats; `chosen` is its equal with less doubtful numbers
    small: tuple[Added, ...]  # effects that explain too little to be named
    notes: tuple[str, ...]  # on added ports, and on effects that are small or in doubt


def confirmed(study: Study, workers: int, progress: Callable[[str], None]) -> Confirmed:
    """Search effects, and return the best that explain a share of the gap.

    A port is added between ports at which equal and opposite efforts are missing, at first or beside what is
    named, and between all ports of one kind if no effect at one of them explains the gap.
    """
    search = begun(study, workers, progress)
    if pairs := _opposite(search.base):
        return _with_ports(search, pairs)
    found, pairs = _judged(search, ()), comparable_ports(study.system)
    if found.chosen.hypothesis.effects:
        pairs = _opposite(found.chosen, BESIDE)
        return _with_ports(search, pairs) if pairs else found
    if search.candidates.leaves_little(0) or not 0 < len(pairs) <= MOST_BETWEEN:
        return found
    progress("add ports between ports, because no effect at one of them explains the gap")
    search, names = _between(search, pairs)
    note = f"no effect at one port explains the gap: effects between ports were tried too, at {listed(names)}"
    return _judged(search, [note])


def _opposite(fitted: FittedHypothesis, rest: float | None = None) -> Pairs:
    """Pairs of ports at which equal and opposite efforts are missing in the learned experiments."""
    study = fitted.hypothesis.study
    if not comparable_ports(study.system):
        return ()
    model = judged_model("", fitted)
    learned = replace(model, logs=model.logs.among(study.learned))
    lacking = Corrections.of(learned, study.horizon, Sensors(learned.logs), study.thresholds)
    port = study.system.port
    return tuple((port(one.name), port(other.name)) for one, other in opposite_ports(lacking, rest))


def _with_ports(search: EffectSearch, pairs: Pairs) -> Confirmed:
    """What is found with ports between the ports of each pair."""
    search.progress("add a port where equal and opposite efforts are missing")
    larger, names = _between(search, pairs)
    notes = [
        f"equal and opposite efforts are missing at {one.name} and {other.name}: effects between them "
        f"were tried too, at the port {name}, whose coordinates are those of {one.name} less those of "
        f"{other.name}"
        for name, (one, other) in zip(names, pairs, strict=True)
    ]
    return _judged(larger, notes)


def _between(search: EffectSearch, pairs: Pairs) -> tuple[EffectSearch, tuple[str, ...]]:
    """A search with a port between the ports of each pair, and the names of the new ports."""
    system, names = with_ports_between(search.study.system, pairs)
    return EffectSearch(replace(search.study, system=system), search.workers, search.progress), names


def _judged(search: EffectSearch, notes: Iterable[str]) -> Confirmed:
    """The best candidate, of whose effects each lowers the error of all experiments by a share."""
    candidates = search.run()
    search.progress("judge the models on all experiments")
    best, small = _of_size(search, candidates.fits[candidates.named()])
    before = judged_model("re-identified", search.base)
    chosen = _less_doubtful(search, best, before.gap)
    sure = is_confirmed(chosen.hypothesis, before.gap, judged_model("", chosen).gap)
    doubts = [] if sure else [_doubt(chosen)]
    further = _too_small(search, chosen, small)
    return Confirmed(search, chosen, before, best, tuple(small), (*notes, *doubts, *further))


def _less_doubtful(search: EffectSearch, best: FittedHypothesis, before: Gap) -> FittedHypothesis:
    """Of the hypotheses that the logs cannot tell apart, the one with the fewest effects of doubtful numbers.

    The held-out experiments must confirm it.
    """
    if not best.hypothesis.effects:
        return best
    candidates = search.candidates
    number = candidates.fits.index(best)
    doubts = {number: doubtful(candidates, number)}
    for k, equal in equals(candidates, number).items():
        if best.hypothesis.effects[k].key in doubts[number]:
            doubts |= {other: doubtful(candidates, other) for other in equal}
    order = sorted(doubts, key=lambda k: len(doubts[k]))  # of as many doubts, the best first
    better = (candidates.fits[k] for k in order[: order.index(number)])
    gaps = ((fitted, judged_model("", fitted).gap) for fitted in better)
    return next((f for f, gap in gaps if is_confirmed(f.hypothesis, before, gap)), best)


def _of_size(search: EffectSearch, fitted: FittedHypothesis) -> tuple[FittedHypothesis, list[Added]]:
    """A hypothesis without the effects that explain too little of the gap, and these, the smallest first."""
    small = list[Added]()
    while effects := fitted.hypothesis.removable:
        gap = gap_of_all_runs(fitted)
        each = [(_share(gap_of_all_runs(search.without(fitted, e)), gap), e) for e in effects]
        share, least = min(each, key=lambda one: one[0])
        if share >= SMALLEST_SHARE:
            break
        fitted, small = search.without(fitted, least), [*small, least]
    return fitted, small


def _share(without: Gap, gap: Gap) -> float:
    """Largest share over the outputs by which an effect lowers the squared gap `without` it.

    Friction in one of six joints matters to the outputs of this joint, however much others are off.
    """
    shares = (
        1.0 - (gap.per_output[name] / value) ** 2 for name, value in without.per_output.items() if value > 0.0
    )
    return max(shares, default=0.0)


def _doubt(chosen: FittedHypothesis) -> str:
    """What is said where held-out experiments do not confirm the named effects."""
    every = dict.fromkeys(f"{e.family} at {e.place.channel}" for e in chosen.hypothesis.effects)
    return (
        f"{listed(list(every))}: the held-out experiments are hardly predicted better, so that the answer is "
        "less sure; hold out others (seed=1)"
    )


def _too_small(search: EffectSearch, chosen: FittedHypothesis, small: Sequence[Added]) -> Iterator[str]:
    """Sentences on effects that would be named too if every error mattered."""
    thresholds = replace(search.study.thresholds, negligible_error=0.0)
    candidates, own = Candidates(search.candidates.predictions, thresholds), chosen.hypothesis.key
    larger = candidates.fits[candidates.named()]
    further = {e.key: e for e in larger.hypothesis.effects if e.key not in own}
    if not own < larger.hypothesis.key or further.keys() & {e.key for e in small}:
        return
    share = f"{100.0 * search.study.thresholds.negligible_error:.3g} %"
    for added in further.values():
        shared = [n for n in dict.fromkeys((*added.delays, *added.reported)) if n in larger.fit.values]
        numbers = [f"{n} = {quantity(larger.fit.values[n], added.units[n])}" for n in shared]
        told = ", ".join(numbers) or "fitted per experiment"
        yield (
            f"{named(added)} ({told}) lowers the error further, but by less than {share} of that of "
            "persistence, which is too little to be named"
        )


def small_effects(small: Iterable[Added], said: Iterable[Added]) -> list[str]:
    """Return sentences on effects that explain too little, but for those that are named or equal to one."""
    keys = {effect.key for effect in said}
    each = dict.fromkeys(named(effect) for effect in small if effect.key not in keys)
    return [
        f"{name} lowers the squared error of all experiments by less than {100.0 * SMALLEST_SHARE:g} %, "
        "which is too little to be named"
        for name in each
    ]
