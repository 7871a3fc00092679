"""Numbers and verdicts of the tutorial on small made-up tables."""

from itertools import product

import numpy as np
import pandas as pd
import pytest

from pipeline.chapters.chapter2 import Region, claims, curve_errors, numbers

CURRENT = np.linspace(2.0, 20.0, 19)


def curves(inside: float, outside: float) -> pd.DataFrame:
    """Physics that is 0.01 off everywhere, and networks that are about so much off, the third exactly."""
    within = (CURRENT >= 4.0) & (CURRENT <= 15.0)
    off = {"physics": 0.01 + 0.0 * CURRENT, "network": np.where(within, inside, outside)}
    parts = [("physics", 0), *(("network", seed) for seed in range(5))]
    curves = []
    for model, seed in parts:
        efficiency = 0.7 + off[model] * (1.0 + 0.01 * (seed - 2) * (model == "network"))
        head = {"model": model, "seed": seed, "current": CURRENT, "truth": 0.7}
        curves.append(pd.DataFrame({**head, "efficiency": efficiency}))
    return pd.concat(curves)


def swings(black_box: dict[str, float]) -> pd.DataFrame:
    rows = [
        (group, model, f"{group}{k}", fold, (0.1 if model == "physics" else black_box[group]) * (1 + 0.1 * k))
        for group, model, k, fold in product(("explored", "unseen"), ("physics", "black_box"), range(5), "ab")
    ]
    return pd.DataFrame(rows, columns=["group", "model", "id", "fold", "rmse"])


def test_a_region_is_the_hull_of_what_was_seen() -> None:
    rng = np.random.default_rng(0)
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
    region = Region(np.concatenate([corners, rng.uniform(0.1, 0.9, (50, 2))]))
    assert {tuple(corner) for corner in region.outline} == {tuple(corner) for corner in corners}
    assert region.holds(np.array([[1.9, 0.9], [2.1, 0.5], [1.0, -0.1]])).tolist() == [True, False, False]


def test_errors_are_apart_inside_and_outside() -> None:
    found = curve_errors(curves(0.002, 0.2), 4.0, 15.0).set_index(["model", "region", "seed"])["rmse"]
    assert found["network", "inside", 2] == pytest.approx(0.002)
    assert found["network", "outside", 2] == pytest.approx(0.2)
    assert [found["physics", region, 0] for region in ("inside", "outside")] == pytest.approx([0.01, 0.01])


@pytest.mark.parametrize(
    ("inside", "outside", "verdicts"),
    [(0.2, 5.0, ["holds", "holds"]), (2.0, 0.5, ["does not hold", "does not hold"])],
)
def test_a_verdict_follows_the_numbers(inside: float, outside: float, verdicts: list[str]) -> None:
    static = curve_errors(curves(0.01 * inside, 0.01 * outside), 4.0, 15.0)
    rows = claims(static, swings({"explored": 0.1 * inside, "unseen": 0.1 * outside}))
    assert [row["verdict"] for row in rows] == 2 * verdicts
    assert [row["ours"] for row in rows] == pytest.approx([inside, outside, inside, outside])
    assert {row["chapter"] for row in rows} == {2}


def test_a_physics_without_scatter_counts_once_and_four_networks_are_too_few() -> None:
    static = curve_errors(curves(0.002, 0.05), 4.0, 15.0)
    few = static[static["seed"] < 4]
    rows = claims(few, swings({"explored": 0.02, "unseen": 0.5}))
    assert [row["verdict"] for row in rows] == [*2 * ["too few repeats"], *2 * ["holds"]]


def test_runs_are_compared_in_pairs() -> None:
    # the runs differ far more than the models do
    errors = swings({"explored": 0.099, "unseen": 0.101})
    static = curve_errors(curves(0.002, 0.05), 4.0, 15.0)
    assert [row["verdict"] for row in claims(static, errors)][2:] == ["holds", "holds"]
    held_out = errors[~errors["id"].str.endswith("4")]
    assert [row["verdict"] for row in claims(static, held_out)][2:] == 2 * ["too few repeats"]


def test_numbers_have_units_and_say_how_many() -> None:
    sizes = pd.DataFrame({"hidden": [1, 1, 8, 8], "seed": [0, 1] * 2, "new": [0.03, 0.05] * 2})
    sizes = sizes.assign(penalty=0.0, training=0.02)
    static = curve_errors(curves(0.002, 0.2), 4.0, 15.0)
    about = {"resistance": 5.0, "friction": 0.006}
    found = numbers(about, static, sizes, swings({"explored": 0.05, "unseen": 0.4}))
    assert found["motor"]["friction"] == {"value": 0.006, "unit": "A/V"}
    assert found["efficiency"]["outside"]["network"]["rmse"]["n"] == 5
    assert found["sizes"]["penalty 0"]["8 neurons"]["new"]["value"] == pytest.approx(0.04)
    assert found["pendulum"]["unseen"]["black_box"]["rmse"]["value"] == pytest.approx(0.48)
