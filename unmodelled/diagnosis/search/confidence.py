"""How far a verdict can be believed: the share of verdicts with the same signs that were right.

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

from unmodelled.diagnosis.data.diagnosis import Verdict
from unmodelled.diagnosis.search.choose import PARSIMONY, SIGNIFICANT, Scores, above_floor
from unmodelled.effects.added import Added

#: The least of a sign that is a logarithm, and what confidence can be without or with all of them.
LEAST, LOWEST, HIGHEST = 1e-2, 0.02, 0.99
#: Beyond this multiple of the noise, what is left says no more: an encoder may hardly have any noise.
FAR = 10.0
WEIGHTS = Path(__file__).with_name("calibration.json")


@dataclass(frozen=True)
class Signs:
    """What a verdict is believed by, decimal logarithms.

    Attributes:
        left: of the mean square error that is left beyond the noise, in that of the noise.
        margin: of the loss by which the best model that says otherwise is worse, in tolerances of the loss.
        worth: of the loss that the effects save, or that the best one would, in what is significant.
        effects: how many there are (no logarithm).
    """

    left: float
    margin: float
    worth: float
    effects: float

    @classmethod
    def of(cls, scores: Scores, named: int) -> Signs:
        """Of the named model among all that were fitted."""
        chosen, losses = scores.fits[named], scores.losses.sum(1)
        single = scores.ranked(1)
        compared = named if chosen.hypothesis.effects else (single[0] if single else named)
        return cls(
            left=_log(min(above_floor(chosen), FAR)),
            margin=_log(_margin(scores, named) / (PARSIMONY * scores.count)),
            worth=_log(float(losses[0] - losses[compared]) / SIGNIFICANT),
            effects=float(len(chosen.hypothesis.effects)),
        )


def confidence(verdict: Verdict, signs: Signs) -> float:
    """From 0 to 1; of verdicts given p, about p are right."""
    weights = _weights()[verdict]
    score = weights["intercept"] + sum(weights[name] * value for name, value in asdict(signs).items())
    return float(np.clip(1.0 / (1.0 + np.exp(-score)), LOWEST, HIGHEST))


@cache
def _weights() -> Mapping[str, Mapping[str, float]]:
    found: Mapping[str, Mapping[str, float]] = json.loads(WEIGHTS.read_text())
    return found


def _margin(scores: Scores, named: int) -> float:
    """By how much the best model with other effects, none of them said to be alike, is worse."""
    own = scores.fits[named].hypothesis.effects
    alike = scores.alike(named)
    said = [{_where(effect), *map(_where, alike[k])} for k, effect in enumerate(own)]
    others = [
        k for k in scores.ranked(max(len(own), 1)) if not _says(scores.fits[k].hypothesis.effects, said)
    ]
    if not others:
        return np.inf
    return float(min(scores.total[k] for k in others) - scores.total[named])


def _says(effects: tuple[Added, ...], said: list[set[tuple[str, str]]]) -> bool:
    """Whether every effect is among those of one of the named ones."""
    return bool(said) and all(any(_where(effect) in one for one in said) for effect in effects)


def _where(effect: Added) -> tuple[str, str]:
    return effect.family, effect.place.channel


def _log(value: float) -> float:
    return float(np.log10(np.clip(value, LEAST, 1.0 / LEAST**2)))
