"""What a search has found and the held-out experiments confirm."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from unmodelled.diagnosis.answer.sentences import named
from unmodelled.diagnosis.data.gap import Gap, shrink
from unmodelled.diagnosis.data.remark import listed, quantity
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.sensors import Sensors
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.data.thresholds import Thresholds
from unmodelled.diagnosis.decide.decision import equals
from unmodelled.diagnosis.decide.undetermined import doubtful
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.search.candidates import Candidates
from unmodelled.diagnosis.search.effect_search import EffectSearch
from unmodelled.diagnosis.search.input_hold import begun
from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.diagnosis.where.opposite import Pairs, comparable_ports, opposite_ports, with_ports_between
from unmodelled.effects.added import Added

#: Pairs of ports up to which a port is added between all of them where nothing else explains the gap.
MOST_BETWEEN = 3
#: Share that equal and opposite efforts beside named effects may leave of what only two efforts explain: the
#: named effects leave errors of their own.
BESIDE = 0.5
#: Effects that held-out experiments refuse before the search goes on without them no more: each further one
#: may pass by chance.
MOST_REFUSED = 3


@dataclass(frozen=True, eq=False)
class Confirmed:
    """A hypothesis that predicts left-out experiments best and that the held-out experiments confirm."""

    search: EffectSearch
    chosen: FittedHypothesis  # hypothesis to name; without effects if none is confirmed
    reidentified: JudgedModel  # the physics without effects, judged on the held-out experiments
    best: FittedHypothesis  # the simplest that none beats; `chosen` is its equal with less doubtful numbers
    refused: tuple[Added, ...]  # effects that the held-out experiments refused
    notes: tuple[str, ...]  # on ports that were added and on effects that are too small, a sentence each


def confirmed(study: Study, workers: int, progress: Callable[[str], None]) -> Confirmed:
    """Search effects, and return what the held-out experiments confirm.

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
    """What is confirmed with ports between the ports of each pair."""
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
    """The best candidate that the held-out experiments confirm.

    An effect that they refuse may have hidden one that they confirm, such as a single delay the filters of
    two sensors: the search goes on without it, some times.
    """
    before, refused = judged_model("re-identified", search.base), list[Added]()
    chosen = _best(search)
    while gone := _refused(search, chosen, before.gap):
        refused += gone
        if len(search.refused) < MOST_REFUSED:
            search.refused |= {e.key for e in gone}
            chosen = _best(search)
        else:
            every = len(gone) == len(chosen.hypothesis.effects)
            chosen = search.base if every else search.without(chosen, *gone)
    best, chosen = chosen, _less_doubtful(search, chosen, before.gap)
    further = _too_small(search, chosen, refused)
    return Confirmed(search, chosen, before, best, tuple(refused), (*notes, *further))


def _less_doubtful(search: EffectSearch, best: FittedHypothesis, before: Gap) -> FittedHypothesis:
    """Of the hypotheses that the logs cannot tell apart, the one with the fewest effects of doubtful numbers.

    The held-out experiments must confirm it, too.
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
    return next((fitted for fitted in better if not _refused(search, fitted, before)), best)


def _best(search: EffectSearch) -> FittedHypothesis:
    """The candidate that a search names; the held-out experiments judge it next."""
    candidates = search.run()
    search.progress("judge the models on the held-out experiments")
    return candidates.fits[candidates.named()]


def _refused(search: EffectSearch, named: FittedHypothesis, before: Gap) -> Sequence[Added]:
    """Of the effects that hardly lower the error of held-out experiments, the one without which it is lowest.

    All of them, if together they do not lower it by a material share, or not below a share of that of
    persistence: a model that predicts hardly better than no model explains nothing. `before` is the gap
    without any.
    """
    effects, thresholds = named.hypothesis.removable, search.study.thresholds
    gap = judged_model("", named).gap
    without = [(judged_model("", search.without(named, effect)).gap, effect) for effect in effects]
    idle = [(rest.value, effect) for rest, effect in without if not _is_lower(gap, rest, thresholds)]
    if len(effects) > 1 and idle:
        return [min(idle, key=lambda one: one[0])[1]]
    useful = gap.value <= thresholds.useful_error * gap.persistence
    lower = useful and shrink(before.value, gap.value, before.floor) >= thresholds.material_shrink
    return () if lower else named.hypothesis.effects


def _is_lower(gap: Gap, rest: Gap, thresholds: Thresholds) -> bool:
    """Whether a gap is lower than another one by a share in the geometric mean of the outputs.

    Friction in one of six joints matters to the outputs of this joint, however much others are off.
    """
    pairs = [(gap.per_output[name], value) for name, value in rest.per_output.items() if value > 0.0]
    least = 1.0 - thresholds.held_out_gain
    return math.prod(after / value for after, value in pairs) <= least ** len(pairs)


def _too_small(search: EffectSearch, chosen: FittedHypothesis, refused: Sequence[Added]) -> Iterator[str]:
    """Sentences on effects that would be named too if every error mattered."""
    thresholds = replace(search.study.thresholds, negligible_error=0.0)
    candidates, own = Candidates(search.candidates.predictions, thresholds), chosen.hypothesis.key
    larger = candidates.fits[candidates.named()]
    further = {e.key: e for e in larger.hypothesis.effects if e.key not in own}
    if not own < larger.hypothesis.key or further.keys() & {e.key for e in refused}:
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


def refusals(refused: Iterable[Added], said: Iterable[Added]) -> list[str]:
    """Return sentences on refused effects; one that the answer names, or lists as equal, is not refused."""
    keys = {effect.key for effect in said}
    each = dict.fromkeys(named(effect) for effect in refused if effect.key not in keys)
    return [
        f"{name} predicts the fitted experiments better, but not the held-out ones, or hardly better than "
        "no model: it is not named"
        for name in each
    ]
