"""The decision among fitted candidates: verdict, effects that cannot be told apart, remainder.

This is the only place that turns errors of candidates into a verdict: another rule replaces `decide`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unmodelled.diagnosis.data.gap import Gap, shrink
from unmodelled.diagnosis.data.result import Remainder, Verdict
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.left_out import LeftOut
from unmodelled.diagnosis.search.candidates import Candidates, exchanged
from unmodelled.effects.added import DISCOVERED, Added


@dataclass(frozen=True, eq=False)
class Decision:
    """A decision about fitted candidates."""

    verdict: Verdict  # all but check_logs
    candidates: Candidates
    named: int  # number of the named candidate in `candidates.fits`; 0 is the known physics
    #: Effects that these data cannot tell from one of the named candidate, by its number, the best first.
    indistinguishable: Mapping[int, tuple[Added, ...]]
    remainder: Remainder | None  # None if a flexible model predicts no more and the rest is small

    @property
    def prediction(self) -> LeftOut:
        """Return the left-out predictions of the named candidate."""
        return self.candidates.predictions[self.named]

    @cached_property
    def alike(self) -> tuple[LeftOut, ...]:
        """Return the left-out predictions of candidates that are as good as the named one."""
        return tuple(self.candidates.predictions[k] for k in self.candidates.as_good(self.named))


def decide(
    candidates: Candidates,
    named: int,
    flexible: Candidates,
    held_out: Gap,
    before: Gap,
    best: int | None = None,
) -> Decision:
    """Decide on the verdict.

    Held-out experiments lower it if their gap is not lower than `before`, without effects. `best` is the
    candidate whose equal is named, default the named one itself.
    """
    confirmed = is_confirmed(candidates.fits[named].hypothesis, before, held_out)
    remainder = _remainder(candidates, named, flexible, held_out, confirmed)
    verdicts: tuple[Verdict, Verdict] = ("effect", "main_effect")
    if not candidates.fits[named].hypothesis.effects:
        verdicts = ("no_gap", "unknown")
    verdict = verdicts[remainder is not None]
    others = indistinguishable(candidates, named if best is None else best, named)
    return Decision(verdict, candidates, named, others, remainder)


def is_confirmed(named: Hypothesis, before: Gap, held_out: Gap) -> bool:
    """Return whether held-out experiments are predicted better with the named effects than without any."""
    least = named.study.thresholds.material_shrink
    return not named.effects or shrink(before.value, held_out.value, before.floor) >= least


def _is_unexplained(candidates: Candidates, named: int, held_out: Gap) -> bool:
    """Whether so large an error is left that something must be missing, even if no network predicts it.

    Named effects explain no gap of which they leave more than a share. Nothing is missing only where there is
    no more than this share of what named effects may leave.
    """
    limits, known = candidates.thresholds, candidates.fits[0]
    seen = float(np.sqrt(max(held_out.value**2 - held_out.floor**2, 0.0)))
    left = _above_noise(candidates.fits[named])
    largest = limits.unexplained_gap * candidates.persistence
    if candidates.fits[named] is known:
        return max(seen, left) > limits.further_rest * largest
    return max(seen, left) > largest or left > limits.further_rest * _above_noise(known)


def _above_noise(fitted: FittedHypothesis) -> float:
    """Root mean square error above the sensor noise, in standard deviations of the outputs."""
    noise = fitted.recording.noise / fitted.recording.scale
    left = np.array(list(fitted.fit.left.per_output.values()))
    return float(np.sqrt(max(float(np.mean(left**2 - noise**2)), 0.0)))


def _remainder(
    candidates: Candidates, named: int, flexible: Candidates, held_out: Gap, confirmed: bool
) -> Remainder | None:
    """What is left beyond the named candidate, and the place of the best further effect."""
    predicts = flexible.beats(2, 1, priced=False)
    if confirmed and not predicts and not _is_unexplained(candidates, named, held_out):
        return None
    left = candidates.remaining**2
    _, before, after = flexible.remaining**2
    own = candidates.fits[named].hypothesis.key
    further = [k for k, f in enumerate(candidates.fits) if own < f.hypothesis.key]
    best = min(further, key=lambda k: float(left[k]), default=None)
    more = () if best is None else candidates.fits[best].hypothesis.effects
    places = [e.place for e in more if e.key not in own]
    return Remainder(
        share=float(left[named]),
        predictable=float(left[named] * (1.0 - after / before)) if predicts else 0.0,
        place=places[0] if places else None,
    )


def equals(candidates: Candidates, named: int) -> Mapping[int, Mapping[int, Added]]:
    """Return the effects that these data cannot tell from the effects of the named candidate.

    By number of the effect and, the best first, by number of the candidate that has the other one. Two
    candidates are compared that differ in one effect only. A formula is no rival of a law of the library: it
    was chosen among many to be like it.
    """
    own = candidates.fits[named].hypothesis.effects
    found: dict[int, dict[int, Added]] = {k: {} for k in range(len(own))}
    for other in np.argsort(candidates.remaining).tolist():
        swapped = exchanged(own, candidates.fits[other].hypothesis.effects)
        if swapped is not None and candidates.alike(named, other):
            k, effect = swapped
            known = {own[k].site, *(e.site for e in found[k].values())}
            rival = effect.site not in known and effect.family != DISCOVERED
            if rival and len(found[k]) < candidates.thresholds.most_equal:
                found[k][other] = effect
    return found


def indistinguishable(
    candidates: Candidates, best: int, named: int | None = None
) -> Mapping[int, tuple[Added, ...]]:
    """Return what the data cannot tell from the effects of a candidate, or of an equal that is named instead.

    By number of the effect. The equal has one effect of the class of the best; the class stays as it is.
    """
    named = best if named is None else named
    own, effects = (candidates.fits[k].hypothesis.effects for k in (best, named))
    classes = {own[k].key: (own[k], *equal.values()) for k, equal in equals(candidates, best).items()}
    swapped = exchanged(effects, own)
    if swapped is not None:
        classes[effects[swapped[0]].key] = classes.pop(swapped[1].key)
    return {k: tuple(o for o in classes[e.key] if o.site != e.site) for k, e in enumerate(effects)}
