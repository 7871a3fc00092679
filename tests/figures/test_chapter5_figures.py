"""The figures of the cam-follower campaign draw on any campaign, are labelled, and are reproducible."""

from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.cam_follower.cam import TURN, cycloid
from pipeline.figures import examples, panels
from tests.conftest import campaign_of
from tests.figures.checks import Chapter


def run(label: str, H: float, beta: float, V: float) -> dict[str, np.ndarray]:
    t = np.arange(0.0, 1.2, 0.004)
    theta = (0.05 if label == "stall" else 3.2) * TURN * t * (V / 8.0 + 0.3)
    omega = np.full_like(t, theta[-1] / t[-1]) + np.sin(theta)
    h = cycloid(theta, H, beta)[0]
    eps = {"contact": 1e-3, "jump": 0.3, "stall": 0.0}[label] * H * np.sin(theta / 2.0) ** 8
    F = {"contact": 4.0, "jump": -6.0, "stall": 9.0}[label] + 3.0 * np.sin(theta)
    return {
        "t": t, "theta": theta, "omega": omega, "alpha": np.cos(theta), "y": h + eps, "h": h, "eps": eps,
        "F_dagger": F,
    }  # fmt: skip


def stores(folder: Path, labels: list[str]) -> Path:
    """A campaign of two cams, two masses and a voltage for each of `labels`, as the stages leave it."""
    rows, logs = [], []
    for H, beta in ((0.03, 0.75 * np.pi), (0.05, 1.25 * np.pi)):
        for m in (0.7, 1.3):
            for V, label in zip(np.linspace(4.0, 10.0, len(labels)), labels, strict=True):
                log = run(label, H, beta, V)
                share = {"contact": 1e-3, "jump": 0.3, "stall": np.nan}[label]
                lowest = log["F_dagger"].min()
                row = {"H": H, "beta": beta, "m": m, "V": V, "label": label, "eps_share": share}
                row |= {"turns": log["theta"][-1] / TURN, "duration": log["t"][-1], "f_min": lowest}
                rows.append(row | {"f_bar_min": np.nan if label == "stall" else lowest})
                logs.append(log)
    for name in ("trajectories", "features"):
        campaign_of(rows, logs).write(folder / name / "cam_follower")
    return folder


CHAPTER = Chapter(
    ("cams", "trajectories", "campaign", "detachment"),
    lambda: ["stall", "contact", "contact", "jump", "jump"],
    stores,
    (lambda _: ["contact"], lambda _: ["jump", "jump"], lambda _: ["stall"], lambda _: ["stall", "jump"]),
)


def test_examples_follow_from_the_table() -> None:
    strokes, voltages = [0.03, 0.03, 0.05, 0.05, 0.05], [4.0, 6.0, 4.0, 6.0, 8.0]
    table = pd.DataFrame({"exp": [1, 2, 3, 4, 5], "H": strokes, "beta": np.pi, "m": 1.0, "V": voltages})
    table["label"] = ["contact", "contact", "contact", "jump", "jump"]
    table["eps_share"] = [0.001, 0.002, 0.003, 0.1, 0.5]
    assert examples.nominal_and_bouncing(table) == (2, 4)  # the contact of the same cam, not the median one
    assert examples.nominal_and_bouncing(table[table["label"] == "contact"])[1] is None
    assert examples.centre(table) == {"V": 6.0, "m": 1.0, "H": 0.05, "beta": np.pi}
    assert examples.varied(table, "V") == [2, 3, 4] and examples.varied(table, "H") == [1, 3]


def test_folded_angle_does_not_wrap_where_the_shaft_swings_back() -> None:
    theta = TURN * 2 + np.array([0.01, -0.01, 1.0, 3.0, 6.0])
    np.testing.assert_allclose(examples.folded(theta), [0.01, -0.01, 1.0, 3.0, 6.0], atol=1e-12)


def test_cells_meet_half_way_between_levels() -> None:
    np.testing.assert_allclose(panels.edges(np.array([1.0, 2.0, 4.0])), [0.5, 1.5, 3.0, 5.0])
    assert np.diff(panels.edges(np.array([3.0]))) > 0
