"""Confidence of a verdict: the share of right verdicts among cases with known faults and the same signs.

The weights in calibration.json were fitted to cases of the withheld machines whose seeds no reported number
uses (`python -m pipeline calibrate_withheld`).
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
from unmodelled.diagnosis.search.candidates import Candidates, noise_ratio
from unmodelled.effects.added import Added

#: Range of a calibrated confidence; the calibration has too few cases to say more.
LOWEST_CONFIDENCE, HIGHEST_CONFIDENCE = 0.02, 0.99
#: Range of the signs that are logarithms. Beyond the last of these noise ratios a remaining gap says no more:
#: an encoder may hardly have any noise. The weights were fitted with these values and hold for no others.
LEAST_SIGN, LARGEST_SIGN, LARGEST_NOISE_RATIO = 1e-2, 1e4, 10.0
WEIGHTS = Path(__file__).with_name("calibration.json")


@dataclass(frozen=True)
class Signs:
    """The signs that the confidence of a verdict is computed from, as decimal logarithms.

    Attributes:
        left: noise ratio of the named candidate (remaining mean square error in noise variances, less one).
        margin: loss by which the best candidate with other effects is worse, in penalties of one unit of
            complexity.
        worth: loss that the effects save, or that the best single effect would save, in significant losses.
        effects: number of named effects (no logarithm).
    """

    left: float
    margin: float
    worth: float
    effects: float

    @classmethod
    def of(cls, candidates: Candidates, decision: Decision) -> Signs:
        """Return the signs of a decision.

        Args:
            candidates: fitted hypotheses.
            decision: decision among them.
        """
        named, limits = decision.named, candidates.thresholds
        chosen, losses = candidates.fits[named], candidates.losses.sum(1)
        single = candidates.ranked(1)
        compared = named if chosen.hypothesis.effects else (single[0] if single else named)
        return cls(
            left=_log(min(noise_ratio(chosen), LARGEST_NOISE_RATIO)),
            margin=_log(_margin(candidates, decision) / (limits.penalty * candidates.count)),
            worth=_log(float(losses[0] - losses[compared]) / limits.significant_loss),
            effects=float(len(chosen.hypothesis.effects)),
        )


def confidence(verdict: Verdict, signs: Signs) -> float:
    """Return the calibrated probability that a verdict is right.

    Args:
        verdict: effect, no_gap or unknown.
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


def _margin(candidates: Candidates, decision: Decision) -> float:
    """The loss by which the best candidate is worse whose effects are neither named nor indistinguishable."""
    own = candidates.fits[decision.named].hypothesis.effects
    equal = [{_where(effect), *map(_where, decision.indistinguishable[k])} for k, effect in enumerate(own)]
    others = [
        k
        for k in candidates.ranked(max(len(own), 1))
        if not _among(candidates.fits[k].hypothesis.effects, equal)
    ]
    if not others:
        return np.inf
    return float(min(candidates.penalised[k] for k in others) - candidates.penalised[decision.named])


def _among(effects: tuple[Added, ...], equal: list[set[tuple[str, str]]]) -> bool:
    """Whether every effect is named or indistinguishable from a named one."""
    return bool(equal) and all(any(_where(effect) in one for one in equal) for effect in effects)


def _where(effect: Added) -> tuple[str, str]:
    return effect.family, effect.place.channel


def _log(value: float) -> float:
    return float(np.log10(np.clip(value, LEAST_SIGN, LARGEST_SIGN)))
