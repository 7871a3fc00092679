"""Compute the numbers of the withheld check from its table of cases.

The table has the columns of `answers.judged`, and kind, case, seconds (s) and memory (MB).
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from pipeline.chapters.leaves import SAMPLES, mean_leaf
from pipeline.chapters.summary import share
from pipeline.withheld.judging import CONFIDENT, NAMING
from unmodelled.base.arrays import Array

#: Of the confidence, from 0 to 1.
BINS = 10
#: Kinds of cases with effects of the library.
KINDS = ("single", "local", "pair", "several")
#: Who finds an effect -> column of the table.
FOUND = {"oracle": "seen", "in_set": "all_reported", "top1": "first", "sparse_regression": "sparse_first"}
#: What a list of misses shows.
SHOWN = ["kind", "case", "system", "level", "truth", "said", "confidence", "seen", "shrink", "oracle_shrink"]
#: Edges of the bins of the level of an effect, in typical sizes.
LEVELS = np.geomspace(0.3, 3.0, 7)
PROTOCOL = (
    "virtual machines that share no code with the models, effects of 0.3 to 3 typical sizes; right: family "
    "and channel, or what the logs cannot tell from it; single, local and pair count where a fit that knows "
    "the effects (the oracle) shows that the logs tell of them"
)


def scores(cases: pd.DataFrame) -> dict[str, Any]:
    """Return the leaves of a table of cases, without leaves that have no case.

    - single, local: of the cases whose effect the oracle sees; top1: the strongest named effect is right;
      in_set: what is right is named or said to be indistinguishable; channel; set_size. local.placed: also
      the experiments in which it acts. seen: share of the cases that the oracle sees.
    - pair: exact: both and nothing else; one: at least one of them.
    - null: correct: no gap. outside: of the cases with a gap; flagged: verdict unknown; wrong: another
      verdict that is not right, with a confidence of at least 0.8.
    - several: three or four effects; exact and one as for pair, of the cases that the oracle sees.
    - null.no_gap: verdict no_gap; correct counts a verdict that names parts of the measurement chain, too.
    - material: share of the material planted effects that are named; whole: share of the cases with all.
    - harmful: share of the answers with named effects that do not lower the error on validation experiments.
    - coverage: share of the intervals of identified parameters that contain the true value, by verdict.
    - set_size, channel: of single, local and pair together, channel of outside besides.
    - shrink_of_oracle: the shrink of the diagnosis as a share of that of the oracle, at most 1; of the cases
      with effects that it sees.
    - calibration_error: expected calibration error of the confidence over ten bins, of all cases;
      calibration: by verdict.
    - sparse_regression, network: the yardsticks; the latter: a network in every port, which names nothing.
    """
    kinds = {str(kind): group for kind, group in cases.groupby("kind")}
    seen = {kind: group[group["seen"]] for kind, group in kinds.items()}
    empty = cases.iloc[:0]
    named = pd.concat([seen.get(kind, empty) for kind in KINDS])
    placed = pd.concat([named, seen.get("outside", empty)])
    found: dict[str, Any] = {
        "single": single(kinds.get("single", empty)),
        "local": single(kinds.get("local", empty)) | _shares(seen.get("local", empty), placed="placed"),
        "pair": _seen(kinds.get("pair", empty)) | _shares(seen.get("pair", empty), exact="exact", one="one"),
        "several": _seen(kinds.get("several", empty))
        | _shares(seen.get("several", empty), exact="exact", one="one"),
        "null": _nulls(kinds.get("null", empty)),
        "outside": _seen(kinds.get("outside", empty)) | _outside(seen.get("outside", empty)),
        "set_size": _mean(named.loc[named["verdict"].isin(NAMING), "set_size"], "effects"),
        **_shares(placed, channel="channel"),
        "shrink_of_oracle": _of_oracle(named, "shrink"),
        "calibration_error": calibration_error(cases) if len(cases) else {},
        "calibration": {
            str(verdict): calibration_error(group) for verdict, group in cases.groupby("verdict")
        },
        "material": _material(pd.concat([kinds.get(kind, empty) for kind in KINDS])),
        "harmful": _harmful(cases),
        "coverage": _coverage(cases),
        "sparse_regression": _sparse(seen, kinds),
        "network": {"shrink_of_oracle": _of_oracle(named, "network_shrink")},
    }
    return _pruned(found)


def listed(cases: pd.DataFrame) -> pd.DataFrame:
    """Return the scores as a table: one row per number, with its value on every machine."""
    systems = {str(name): dict(_leaves(scores(group))) for name, group in cases.groupby("system")}
    rows = []
    for name, leaf in _leaves(scores(cases)):
        low, high = leaf.get("interval", (None, None))
        row = {"measure": name, "unit": leaf["unit"], "n": leaf["n"]}
        row |= {"value": leaf["value"], "low": low, "high": high}
        rows.append(row | {system: own.get(name, {}).get("value") for system, own in systems.items()})
    return pd.DataFrame(rows)


def _leaves(content: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    for name, inner in content.items():
        if "value" in inner:
            yield prefix + name, inner
        else:
            yield from _leaves(inner, f"{prefix}{name}.")


def single(cases: pd.DataFrame) -> dict[str, Any]:
    """Return the leaves of cases with one effect: seen, top1, in_set, channel and set_size, see `scores`."""
    seen = cases[cases["seen"]]
    sizes = seen.loc[seen["verdict"].isin(NAMING), "set_size"]
    return {
        **_seen(cases),
        **_shares(seen, top1="first", in_set="all_reported", channel="channel"),
        "set_size": _mean(sizes, "effects"),
    }


def _nulls(cases: pd.DataFrame) -> dict[str, Any]:
    silent = cases.assign(silent=cases["verdict"] == "no_gap")
    return _shares(silent, correct="right", no_gap="silent")


def _material(cases: pd.DataFrame) -> dict[str, Any]:
    some = cases[cases["material"] > 0]
    if not len(some):
        return {}
    whole = int((some["material_named"] == some["material"]).sum())
    named = share(int(some["material_named"].sum()), int(some["material"].sum()))
    return {"named": named, "whole": share(whole, len(some))}


def _harmful(cases: pd.DataFrame) -> dict[str, Any]:
    known = cases["harmful"].dropna().astype(bool)
    return share(int(known.sum()), len(known)) if len(known) else {}


def _coverage(cases: pd.DataFrame) -> dict[str, Any]:
    some = cases[cases["intervals"] > 0].groupby("verdict")[["covered", "intervals"]].sum()
    counts = zip(some.index, some["covered"], some["intervals"], strict=True)
    return {str(verdict): share(int(covered), int(many)) for verdict, covered, many in counts}


def _seen(cases: pd.DataFrame) -> dict[str, Any]:
    return _shares(cases, seen="seen")


def _outside(cases: pd.DataFrame) -> dict[str, Any]:
    told = cases["verdict"] == "unknown"
    wrong = ~told & ~cases["right"] & (cases["confidence"] >= CONFIDENT)
    return _shares(cases.assign(told=told, wrong=wrong), flagged="told", wrong="wrong", channel="channel")


def _sparse(seen: dict[str, pd.DataFrame], kinds: dict[str, pd.DataFrame]) -> dict[str, Any]:
    effects = {kind: rows for kind, rows in seen.items() if kind in ("single", "local")}
    found = {kind: _shares(rows, top1="sparse_first") for kind, rows in effects.items()}
    if "null" in kinds:
        found["null"] = _shares(kinds["null"], correct="sparse_first")
    return found


def _shares(cases: pd.DataFrame, **columns: str) -> dict[str, Any]:
    """Share of the cases in which a column is true, by the name of the leaf."""
    if not len(cases):
        return {}
    return {leaf: share(int(cases[column].sum()), len(cases)) for leaf, column in columns.items()}


def _mean(values: pd.Series, unit: str) -> dict[str, Any]:
    return mean_leaf(values.to_numpy(np.float64), unit) if len(values) else {}


def _of_oracle(cases: pd.DataFrame, column: str) -> dict[str, Any]:
    some = cases[cases["oracle_shrink"] > 0.0]
    return _mean((some[column] / some["oracle_shrink"]).clip(upper=1.0), "share")


def _pruned(found: dict[str, Any]) -> dict[str, Any]:
    """Without what is empty."""
    inner = {name: _pruned(value) if isinstance(value, dict) else value for name, value in found.items()}
    return {name: value for name, value in inner.items() if value != {}}


def calibration_error(cases: pd.DataFrame) -> dict[str, Any]:
    """Return the expected calibration error: the mean distance between confidence and share of right answers.

    The mean is taken over ten bins of the confidence, its interval by bootstrap.
    """
    confidence, right = cases["confidence"].to_numpy(np.float64), cases["right"].to_numpy(np.float64)
    rng = np.random.default_rng(0)
    drawn = rng.integers(0, len(cases), (SAMPLES, len(cases)))
    errors = [_expected_error(confidence[rows], right[rows]) for rows in drawn]
    low, high = np.quantile(errors, [0.025, 0.975])
    value = _expected_error(confidence, right)
    return {"value": value, "unit": "-", "interval": [float(low), float(high)], "n": len(cases)}


def _expected_error(confidence: Array, right: Array) -> float:
    bins = np.minimum((confidence * BINS).astype(int), BINS - 1)
    difference = np.bincount(bins, confidence - right, minlength=BINS)
    return float(np.abs(difference).sum() / len(right))


def calibration(cases: pd.DataFrame) -> pd.DataFrame:
    """Return the calibration curve."""
    bins = np.minimum((cases["confidence"] * BINS).astype(int), BINS - 1)
    rows = []
    for _, group in cases.groupby(bins):
        leaf = share(int(group["right"].sum()), len(group))
        low, high = leaf["interval"]
        rows.append((group["confidence"].mean(), leaf["value"], low, high, len(group)))
    return pd.DataFrame(rows, columns=["confidence", "right", "low", "high", "cases"])


def detection(cases: pd.DataFrame) -> pd.DataFrame:
    """Return the shares of single effects that the oracle and the diagnosis find, by level of the effects."""
    single = cases[cases["kind"] == "single"]
    bins = np.clip(np.searchsorted(LEVELS, single["level"], "right") - 1, 0, len(LEVELS) - 2)
    rows = []
    for k, group in single.groupby(bins):
        for name, column in FOUND.items():
            leaf = share(int(group[column].sum()), len(group))
            rows.append((LEVELS[k], LEVELS[k + 1], name, leaf["value"], *leaf["interval"], len(group)))
    return pd.DataFrame(rows, columns=["from", "to", "what", "share", "low", "high", "cases"])


def confusion(cases: pd.DataFrame) -> pd.DataFrame:
    """Count the first named family (or the verdict) by planted family, for effects that the oracle sees."""
    some = cases[cases["kind"].isin(["single", "local"]) & cases["seen"]]
    counts = some.groupby(["family", "first_family"]).size()
    return counts.rename("cases").reset_index()


def misses(cases: pd.DataFrame) -> pd.DataFrame:
    """Return the cases with a wrong answer, the most confident first."""
    return cases.loc[~cases["right"], SHOWN].sort_values("confidence", ascending=False, kind="stable")
