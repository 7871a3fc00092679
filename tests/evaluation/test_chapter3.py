"""Claims of chapter 3: tested over data sets, of which four are too few."""

from typing import Any

import numpy as np
import pandas as pd

from pipeline.chapters.chapter3 import claims
from pipeline.chapters.leaves import mean_leaf
from pipeline.chapters.verdicts import DIRECTION, FAILS, HOLDS, TOO_FEW
from unmodelled.uncertainty.methods import CHAOS, GAUSSIAN, MAXIMUM_ENTROPY


def verdicts(
    data_sets: int, reduction: float = 0.6, gaussian: float = 12.0, entropy: float = 5.0
) -> dict[str, str]:
    """Verdicts where maximum entropy lowers errors by `reduction`, and both overestimate by so much."""
    noise = 1.0 + 0.01 * np.linspace(-1.0, 1.0, data_sets)
    leaf = mean_leaf(reduction * noise, "share")
    samples = {f"samples_{rule}": {"value": 300.0, "lower_bound": False} for rule in ("mc", "qmc")}
    found: dict[str, Any] = {
        "reduction": {of: {"emd": leaf, "log_likelihood_error": leaf} for of in CHAOS},
        "table_3_2": {of: dict.fromkeys(CHAOS, samples) for of in CHAOS},
    }
    exact = {GAUSSIAN: 100.0 * noise, MAXIMUM_ENTROPY: 105.0 * noise}
    over = {GAUSSIAN: gaussian * noise, MAXIMUM_ENTROPY: entropy * noise}
    sets = range(data_sets)
    columns = {m: {"method": m, "exact": exact[m], "log_likelihood": exact[m] + over[m]} for m in CHAOS}
    identified = pd.concat(pd.DataFrame({"data_set": sets, **columns[m]}) for m in CHAOS)
    return {row["id"]: row["verdict"] for row in claims(found, identified, 1000)}


TESTED = {
    *(f"{leaf}_{of}" for leaf in ("emd", "log_likelihood_error") for of in CHAOS),
    "true_log_likelihood",
    "log_likelihood_overestimated",
}


def test_what_is_claimed_holds_over_five_data_sets_and_cannot_over_four() -> None:
    assert set(verdicts(5).values()) == {HOLDS}
    assert {name for name, verdict in verdicts(4).items() if verdict == TOO_FEW} == TESTED


def test_a_smaller_reduction_holds_in_direction_and_a_negative_one_does_not() -> None:
    assert {verdicts(9, reduction=0.1)[f"emd_{of}"] for of in CHAOS} == {DIRECTION}
    assert {verdicts(9, reduction=-0.1)[f"emd_{of}"] for of in CHAOS} == {FAILS}


def test_both_methods_must_overestimate_and_the_gaussian_more() -> None:
    assert verdicts(9, gaussian=4.0)["log_likelihood_overestimated"] == FAILS
    # the Gaussian does not overestimate less for being further off
    assert verdicts(9, gaussian=-9.0)["log_likelihood_overestimated"] == FAILS
    assert verdicts(9, entropy=-1.0)["log_likelihood_overestimated"] == FAILS
