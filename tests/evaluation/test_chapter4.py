"""Claims of chapter 4 on made-up errors of trajectories and courses of parameters."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from pipeline.chapters import chapter4
from pipeline.chapters.verdicts import DIRECTION, FAILS, HOLDS, TOO_FEW

INPUTS = ("nnap", "nnap_theta_omega", "nnap_d_v_t", "nnap_d", "nnap_v")
ADVICE = ["l1 and m3 must be separated: their effects on the model output are correlated (0.95)"]
#: Ratios of neighbouring trajectories: they differ far more than models do.
SPREAD = 1.3


def errors_of(recurrent: float = 0.5, slow: float = 5.0, trajectories: int = 20) -> pd.DataFrame:
    """RMSE of every model: `recurrent` and `slow` times that of the feedforward one."""
    cells = [("leave_one_out", False, 1, m, 1.0 + 0.5 * k) for k, m in enumerate(INPUTS)]
    cells += [("leave_one_out", True, n, "nnap", v) for n, v in ((1, 1.0), (10, 0.8), (300, recurrent))]
    cells += [("slow", False, 1, "nnap", slow)]
    rows = [
        (split, extra, horizon, model, f"run{i}", SPREAD**i * v * (1.0 + 0.001 * i), False)
        for split, extra, horizon, model, v in cells
        for i in range(trajectories if split != "slow" else trajectories // 2)
    ]
    return pd.DataFrame(rows, columns=["split", "extra", "horizon", "model", "id", "rmse", "diverged"])


def history_of(apart: float, together: float) -> pd.DataFrame:
    """Last values of ten folds, m3 and l1 scattered by the given shares."""
    sets = {"m3_J1_Bm": ("m3",), "l1_J1_Bm": ("l1",), "l1_m3_J1_Bm": ("l1", "m3")}
    unit = np.linspace(-1.0, 1.0, 10) / np.std(np.linspace(-1.0, 1.0, 10), ddof=1)
    rows = [
        (name, parameter, 9, 1.0 + (apart if len(names) == 1 else together) * unit[fold])
        for name, names in sets.items()
        for parameter, fold in product(names, range(10))
    ]
    return pd.DataFrame(rows, columns=["set", "parameter", "epoch", "value"])


def verdicts(
    errors: pd.DataFrame, apart: float = 0.05, together: float = 0.2, advice: list[str] = ADVICE
) -> dict[str, str]:
    chapter = chapter4.accuracy(errors)
    chapter["parameters"] = {"m3": {"error": {"value": 0.01}}}
    small = {"value": 0.01}
    chapter["recovered"] = {"spring": {"rmse_share": small}, "no_spring": {"share": small}}
    rows = chapter4.claims(chapter, errors, history_of(apart, together), advice)
    return {row["id"]: row["verdict"] for row in rows}


@pytest.mark.parametrize(
    ("apart", "together", "advice", "verdict"),
    [
        (0.05, 0.2, ADVICE, HOLDS),
        # seventy times the error of m3 with l1 as measured, and yet no more than apart
        (0.8, 0.7, ADVICE, DIRECTION),
        (0.05, 0.2, [], DIRECTION),
        (0.8, 0.7, [], FAILS),
    ],
)
def test_identifiable_sets_compares_like_with_like(
    apart: float, together: float, advice: list[str], verdict: str
) -> None:
    assert verdicts(errors_of(), apart, together, advice)["identifiable_sets"] == verdict


@pytest.mark.parametrize(("recurrent", "verdict"), [(0.5, HOLDS), (0.9, DIRECTION), (1.1, FAILS)])
def test_a_gain_is_tested_in_pairs(recurrent: float, verdict: str) -> None:
    assert verdicts(errors_of(recurrent))["recurrent_gain"] == verdict
    assert verdicts(errors_of(recurrent, trajectories=4))["recurrent_gain"] == TOO_FEW


def test_a_gain_of_one_trajectory_does_not_hold() -> None:
    errors = errors_of(recurrent=1.01)
    longest = (errors["horizon"] == 300) & (errors["id"] == "run19")
    errors.loc[longest, "rmse"] = 0.0
    assert verdicts(errors)["recurrent_gain"] == FAILS


def test_the_region_is_tested_in_pairs() -> None:
    assert verdicts(errors_of())["region_of_operations"] == HOLDS
    assert verdicts(errors_of(slow=0.5))["region_of_operations"] == FAILS
    assert verdicts(errors_of(trajectories=8))["region_of_operations"] == TOO_FEW
