"""Compare predicted with measured detachment run by run, and classify jumps (section 5.4.3)."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.cam_follower.labels import full_revolutions
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.arrays import Array, Indices, Mask
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.learning.splits import Fold

Tables = dict[str, pd.DataFrame]

#: mm^2 in a m^2.
SQUARE_MM = 1e6
#: Where examples stand among the test runs of a label, sorted by their detachment.
QUANTILES = {"jump": (0.25, 0.5, 0.75), "contact": (0.5,)}


@dataclass(frozen=True)
class Observed:
    """Measured detachment of every run of a campaign."""

    experiments: pd.DataFrame  # one row per run, with the columns exp, label, H (m) and eps_share
    sequences: Sequences  # theta (rad), t (s) and eps (m), cut off and padded
    #: Samples of each full revolution of every run; all samples of a run without a full revolution
    turns: list[list[slice]]

    @classmethod
    def of(cls, campaign: Campaign, samples: int) -> "Observed":
        """Read the first samples of every run of a campaign."""
        sequences = Sequences.of(campaign, SequenceInputs(("theta", "t")), samples)
        lengths = sequences.lengths.tolist()
        angles = [theta[:n] for theta, n in zip(sequences.features[..., 0], lengths, strict=True)]
        turns = [full_revolutions(angle) or [slice(0, len(angle))] for angle in angles]
        return cls(campaign.experiments, sequences, turns)

    def mean_maximum(self, eps: Array) -> Array:
        """Return the largest eps (..., runs, steps) per revolution, averaged over a run's revolutions."""
        means = [
            np.mean([eps[..., i, turn].max(-1) for turn in turns], axis=0)
            for i, turns in enumerate(self.turns)
        ]
        return np.stack(means, -1)

    def squared_error(self, eps: Array) -> Array:
        """Return the mean squared error (..., runs) of a predicted detachment eps (..., runs, steps) in m."""
        error = np.where(self.sequences.mask, eps - self.sequences.target, 0.0)
        mean: Array = np.square(error).sum(-1) / self.sequences.lengths * SQUARE_MM
        return mean


def judge(observed: Observed, fold: Fold, eps: Array, jump_share: float) -> Tables:
    """Compare predicted eps (repeats, runs, steps), m, with the measured one in the test runs of a fold."""
    _check_finite(observed, fold, eps)
    # the median over repeats stands in front of the repeats
    every = np.concatenate([np.median(eps, axis=0, keepdims=True), eps])
    height = observed.mean_maximum(every)
    table = observed.experiments
    jump = (table["label"] == "jump").to_numpy()
    share = height / table["H"].to_numpy()
    levels = [threshold(s[fold.train], jump[fold.train], jump_share) for s in share]
    mse, test = observed.squared_error(every), fold.test
    measured = observed.mean_maximum(observed.sequences.target)
    known = table.iloc[test][["exp", "label"]].assign(fold=fold.name, measured=measured[test])
    parts = [
        known.assign(
            repeat=k - 1, mse=mse[k, test], predicted=height[k, test], jumps=share[k, test] > levels[k]
        )
        for k in range(len(every))
    ]
    shown = [row for rows in example_rows(table, test).values() for row in rows]
    examples = [_example(observed, fold, row, every[:, row]) for row in shown]
    return {
        "runs": parts[0].drop(columns="repeat"),
        "repeats": pd.concat(parts[1:], ignore_index=True).drop(columns="measured"),
        "examples": pd.concat(examples, ignore_index=True),
    }


def threshold(share: Array, jump: Mask, default: float) -> float:
    """Return the share of the stroke above which a run is called a jump, by logistic regression.

    The regression uses the standardised logarithm of the shares, because shares span decades; shares below a
    tenth of `default` count as equal. All runs determine the threshold, not only the two runs next to the gap
    between the labels.

    Takes share (runs,), jump (runs,).
    """
    logarithm = np.log(np.maximum(share, 0.1 * default) / default)
    spread = float(logarithm.std())
    if jump.all() or not jump.any() or spread == 0.0:
        return default
    # a second to load, for every evaluation of any model
    from sklearn.linear_model import LogisticRegression

    fitted = LogisticRegression(solver="newton-cholesky").fit(logarithm[:, None] / spread, jump)
    slope, offset = float(fitted.coef_[0, 0]), float(fitted.intercept_[0])
    return float(default * np.exp(-spread * offset / slope)) if slope > 0.0 else default


def example_rows(experiments: pd.DataFrame, test: Indices) -> dict[str, list[int]]:
    """Choose the test runs that figures show, the same for every model. Takes test (runs,)."""
    rows = {}
    for label, quantiles in QUANTILES.items():
        own = test[(experiments["label"].to_numpy() == label)[test]]
        ordered = own[np.argsort(experiments["eps_share"].to_numpy()[own], kind="stable")]
        places = sorted({round(q * (len(own) - 1)) for q in quantiles}) if len(own) else []
        rows[label] = [int(ordered[place]) for place in places]
    return rows


def _example(observed: Observed, fold: Fold, row: int, eps: Array) -> pd.DataFrame:
    n = int(observed.sequences.lengths[row])
    columns = {
        "t": observed.sequences.features[row, :n, 1],
        "measured": observed.sequences.target[row, :n],
        "predicted": eps[0, :n],
        "low": eps[1:, :n].min(0),
        "high": eps[1:, :n].max(0),
    }
    about = observed.experiments.iloc[row]
    return pd.DataFrame({"fold": fold.name, "exp": about["exp"], "label": about["label"], **columns})


def _check_finite(observed: Observed, fold: Fold, eps: Array) -> None:
    wrong = np.argwhere(~np.isfinite(eps) & observed.sequences.mask)
    if len(wrong):
        repeat, run, step = wrong[0]
        exp = observed.experiments["exp"].iloc[run]
        raise BadInput(
            f"fold {fold.name}, repeat {repeat}: prediction of experiment {exp} is not a finite number at "
            f"sample {step}"
        )
