"""Confidence of a verdict: the share of right verdicts among cases with known faults and the same signs.

The weights in calibration.json were fitted to cases of the withheld machines that were diagnosed with other
weights (`python -m pipeline calibrate_withheld`): no reported calibration error is one of a fit.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import numpy as np

from unmodelled.diagnosis.data.result import Verdict
from unmodelled.diagnosis.decide.decision import Decision
from unmodelled.diagnosis.decide.implausible import implausible
from unmodelled.effects.added import Added

#: Range of a calibrated confidence; the calibration has too few cases to say more.
LOWEST_CONFIDENCE, HIGHEST_CONFIDENCE = 0.02, 0.99
#: Largest difference of scores, nats, that counts as a sign: the weights hold for no larger one.
LARGEST_SIGN = 4.0
WEIGHTS = Path(__file__).with_name("calibration.json")


@dataclass(frozen=True)
class Signs:
    """The signs that the confidence of a verdict is computed from.

    Attributes:
        gain: score that the effects gain in left-out experiments, or that the best single effect would gain,
            nats.
        margin: score by which the best candidate with as many other effects is worse, nats.
        predictable: share of the squared error that a network predicts beyond the effects.
        alike: number of effects that cannot be told from the named ones.
        effects: number of named effects; a law at many ports of one kind counts once.
        rest: error that the named effects leave, as a share of that of the known physics.
        doubts: number of remarks on numbers that make no sense as numbers of a machine.
    """

    gain: float
    margin: float
    predictable: float
    alike: float
    effects: float
    rest: float
    doubts: float

    @classmethod
    def of(cls, decision: Decision) -> Signs:
        """Return the signs of a decision.

        Args:
            decision: decision among fitted candidates.
        """
        candidates, named = decision.candidates, decision.named
        own, score = candidates.fits[named].hypothesis.effects, candidates.scores.mean(1)
        single = [k for k in candidates.ranked(1) if k != named]
        compared = named if own or not single else single[0]
        return cls(
            gain=float(np.clip(score[0] - score[compared], 0.0, LARGEST_SIGN)),
            margin=float(np.clip(_margin(decision), 0.0, LARGEST_SIGN)),
            predictable=0.0 if decision.remainder is None else decision.remainder.predictable,
            alike=float(sum(map(len, decision.indistinguishable.values()))),
            effects=float(candidates.steps[named]),
            rest=float(min(candidates.remaining[named], 1.0)),
            doubts=float(len(implausible(decision.prediction, decision.alike))),
        )


def confidence(verdict: Verdict, signs: Signs) -> float:
    """Return the calibrated probability that a verdict is right.

    Args:
        verdict: effect, main_effect, no_gap or unknown.
        signs: signs of the decision.

    Returns:
        From 0.02 to 0.99; of verdicts with confidence p, about the share p is right.
    """
    weights = _weights()[verdict]
    score = weights["intercept"] + sum(weights[name] * value for name, value in asdict(signs).items())
    return float(np.clip(1.0 / (1.0 + np.exp(-score)), LOWEST_CONFIDENCE, HIGHEST_CONFIDENCE))


@cache
def _weights() -> Mapping[str, Mapping[str, float]]:
    found: Mapping[str, Mapping[str, float]] = json.loads(WEIGHTS.read_text())
    return found


def _margin(decision: Decision) -> float:
    """The score by which the best candidate is worse that has neither named nor indistinguishable effects."""
    candidates, score = decision.candidates, decision.candidates.scores.mean(1)
    own = candidates.fits[decision.named].hypothesis.effects
    equal = [{e.site, *(o.site for o in decision.indistinguishable[k])} for k, e in enumerate(own)]
    others = [
        k
        for k in candidates.ranked(max(int(candidates.steps[decision.named]), 1))
        if not _among(candidates.fits[k].hypothesis.effects, equal)
    ]
    return float(score[others[0]] - score[decision.named]) if others else LARGEST_SIGN


def _among(effects: tuple[Added, ...], equal: list[set[tuple[str, str]]]) -> bool:
    """Whether every effect is named or indistinguishable from a named one."""
    return bool(equal) and all(any(effect.site in one for one in equal) for effect in effects)
