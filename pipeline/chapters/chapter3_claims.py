"""Verdicts on the claims of chapter 3."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from pipeline.chapters.chapter3 import LABELS, PROTOCOL, TABLE_3_2
from pipeline.chapters.claims import Row
from pipeline.chapters.leaves import median_interval
from pipeline.chapters.verdicts import DIRECTION, FAILS, HOLDS, TOO_FEW, order_verdict, too_few, worst
from unmodelled.uncertainty.methods import CHAOS, GAUSSIAN, MAXIMUM_ENTROPY

#: Sections 3.4.2 and 3.4.3: by the method at whose optimum it was taken.
PUBLISHED_EMD = {GAUSSIAN: 0.42, MAXIMUM_ENTROPY: 0.47}
PUBLISHED_ERROR = {GAUSSIAN: 0.153, MAXIMUM_ENTROPY: 0.248}
PUBLISHED_GAIN = 0.04


def claims(found: dict[str, Any], identified: pd.DataFrame, samples: int) -> list[Row]:
    """Return the claims of chapter 3 with their verdicts."""
    return [
        *(_reduction(found, of, "emd", PUBLISHED_EMD[of]) for of in CHAOS),
        *(_reduction(found, of, "log_likelihood_error", PUBLISHED_ERROR[of]) for of in CHAOS),
        _gain(identified),
        _overestimate(identified),
        *(_samples_claim(found, rule, samples) for rule in ("mc", "qmc")),
    ]


def _row(id_: str, page: str, claim: str, **rest: Any) -> Row:
    return {"id": id_, "chapter": 3, "page": page, "claim": claim, **rest}


def _reduction(found: dict[str, Any], of: str, leaf: str, published: float) -> Row:
    own = found["reduction"][of][leaf]
    what = {"emd": "EMD", "log_likelihood_error": "error of the log-likelihood"}[leaf]
    low, value = own["interval"][0], own["value"]
    return _row(
        f"{leaf}_{of}",
        "section 3.4.3",
        f"The {what} of maximum entropy is lower than the Gaussian's, at the {LABELS[of]} optimum",
        dissertation=published,
        ours=value,
        interval=own["interval"],
        unit="lower, share",
        protocol=f"{PROTOCOL}; mean over {own['n']} data sets, the observed one included",
        verdict=_reached(value, low, published, own["n"]),
    )


def _gain(identified: pd.DataFrame) -> Row:
    true = identified.pivot(index="data_set", columns="method", values="exact")
    gains = (true[MAXIMUM_ENTROPY] / true[GAUSSIAN] - 1.0).to_numpy()
    low, high = median_interval(gains)  # the exact method may refuse one data set
    return _row(
        "true_log_likelihood",
        "section 3.4.3",
        "The true log-likelihood at the maximum entropy optimum is higher than at the Gaussian one",
        dissertation=PUBLISHED_GAIN,
        ours=float(np.median(gains)),
        interval=[low, high],
        unit="higher, share (median over data sets)",
        protocol=PROTOCOL,
        verdict=_reached(float(np.median(gains)), low, PUBLISHED_GAIN, len(gains)),
    )


def _reached(value: float, low: float, published: float, data_sets: int) -> str:
    """Verdict on a gain: significant by its lower limit, and as large as the text's or not."""
    if too_few(data_sets):
        return TOO_FEW
    return FAILS if low <= 0.0 else HOLDS if value >= published else DIRECTION


def _overestimate(identified: pd.DataFrame) -> Row:
    table = identified.assign(over=identified["log_likelihood"] - identified["exact"])
    over = table.pivot(index="data_set", columns="method", values="over")
    gaussian, entropy = (over[m].to_numpy(np.float64) for m in (GAUSSIAN, MAXIMUM_ENTROPY))
    none = np.zeros_like(gaussian)
    order = ((gaussian, none), (entropy, none), (gaussian, entropy))
    return _row(
        "log_likelihood_overestimated",
        "section 3.4.3",
        "Both methods overestimate the log-likelihood at their optimum, the Gaussian more",
        dissertation="11.8 and 5.3",
        ours=", ".join(f"{LABELS[m]} {over[m].mean():+.1f}" for m in CHAOS),
        unit="estimated - true log-likelihood, mean",
        protocol=f"{PROTOCOL}; overestimated on {(gaussian > 0).mean():.0%} and {(entropy > 0).mean():.0%}; "
        "tested over the data sets in pairs, the worst of three verdicts: the Gaussian overestimates, "
        "maximum entropy overestimates, the Gaussian more",
        verdict=worst(*(order_verdict(*pair, paired=True) for pair in order)),
    )


def _samples_claim(found: dict[str, Any], rule: str, samples: int) -> Row:
    leaves = [found["table_3_2"][of][m][f"samples_{rule}"] for of in CHAOS for m in CHAOS]
    published = [TABLE_3_2[of, m][1 if rule == "mc" else 2] for of in CHAOS for m in CHAOS]
    own = [leaf["value"] for leaf in leaves]
    kind = {"mc": "Monte Carlo", "qmc": "quasi Monte Carlo"}[rule]
    more = "more than " if leaves[int(np.argmax(own))]["lower_bound"] else ""
    return _row(
        f"samples_{rule}",
        "table 3.2",
        f"25 collocation points are as accurate as an order of magnitude more {kind} samples",
        dissertation=f"{min(published)} to {max(published)}",
        ours=f"{min(own):.0f} to {more}{max(own):.0f}",
        unit="simulations a point",
        protocol=f"mean absolute error of the log-likelihood of the 108 points against {samples} samples",
        verdict=HOLDS if min(own) >= 250 else DIRECTION if min(own) > 25 else FAILS,
    )
