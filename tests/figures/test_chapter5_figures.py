"""The figures of the cam-follower campaign draw on any campaign, are labelled, and are reproducible."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axis import Axis
from matplotlib.figure import Figure

from pipeline.cam_follower.cam import TURN, cycloid
from pipeline.figures import examples, panels
from tests.figures.checks import figures_of
from unmodelled.base.campaign import Campaign
from unmodelled.report.figures import style

pytestmark = pytest.mark.long

FIGURES = figures_of("cams", "trajectories", "campaign", "detachment")
names = pytest.mark.parametrize("draw", FIGURES, ids=lambda f: f.__name__)


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
                ends = log["theta"][-1] / TURN, share, log["t"][-1]
                rows.append(
                    (
                        len(rows) + 1,
                        H,
                        beta,
                        m,
                        V,
                        label,
                        *ends,
                        lowest,
                        np.nan if label == "stall" else lowest,
                    )
                )
                logs.append(log)
    columns = ["exp", "H", "beta", "m", "V", "label", "turns", "eps_share", "duration", "f_min", "f_bar_min"]
    table = pd.DataFrame(rows, columns=columns)
    signals = {name: np.concatenate([log[name] for log in logs]) for name in logs[0]}
    offsets = np.cumsum([0, *(len(log["t"]) for log in logs)]).astype(np.int64)
    for name in ("trajectories", "features"):
        Campaign(table, signals, offsets, {"data": "virtual"}).write(folder / name / "cam_follower")
    return folder


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return stores(tmp_path_factory.mktemp("full"), ["stall", "contact", "contact", "jump", "jump"])


def shows_numbers(axis: Axis) -> bool:
    return any(tick.get_visible() and tick.get_text() for tick in axis.get_ticklabels())


@names
def test_every_axis_with_numbers_has_a_name_and_a_unit(draw: Callable[[Path], Figure], data: Path) -> None:
    figure = draw(data)
    figure.draw_without_rendering()
    for axes in figure.axes:
        for axis, shared in ((axes.xaxis, figure.get_supxlabel()), (axes.yaxis, figure.get_supylabel())):
            if axes.axison and shows_numbers(axis):
                text = axis.get_label_text() or shared
                assert "(" in text and text.endswith(")"), f"{draw.__name__}: {text!r} has no unit"


@names
def test_equal_data_give_equal_small_files(
    draw: Callable[[Path], Figure], data: Path, tmp_path: Path
) -> None:
    for name in ("a.svg", "b.svg"):
        style.save(draw(data), tmp_path / name)
    content = (tmp_path / "a.svg").read_bytes()
    assert content == (tmp_path / "b.svg").read_bytes()
    assert len(content) < 1_000_000


@pytest.mark.parametrize(
    "labels", [["contact"], ["jump", "jump"], ["stall"], ["stall", "jump"]], ids="-".join
)
def test_figures_draw_without_some_labels(labels: list[str], tmp_path: Path) -> None:
    folder = stores(tmp_path, labels)
    for draw in FIGURES:
        figure = draw(folder)
        figure.draw_without_rendering()
        assert figure.axes, draw.__name__


@names
def test_caption_is_one_sentence_and_tells_what_to_see(draw: Callable[[Path], Figure]) -> None:
    caption, empty, *see = (draw.__doc__ or "").splitlines()
    assert caption.endswith(".") and empty == "" and len(" ".join(see).split()) > 10


def test_examples_follow_from_the_table() -> None:
    table = pd.DataFrame(
        {
            "exp": [1, 2, 3, 4, 5],
            "H": [0.03, 0.03, 0.05, 0.05, 0.05],
            "beta": np.pi,
            "m": 1.0,
            "V": [4.0, 6.0, 4.0, 6.0, 8.0],
            "label": ["contact", "contact", "contact", "jump", "jump"],
            "eps_share": [0.001, 0.002, 0.003, 0.1, 0.5],
        }
    )
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
