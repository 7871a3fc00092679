"""What single figures of follower jumps show is what the campaign and the tables hold."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.figures.jumps import contributions, errors, example, maxima, settings, tables, trajectories
from tests.figures.jump_tables import FOLDS, SETTINGS, TOLD, Content, make_tables, networks_only, write


@pytest.fixture(scope="module")
def content() -> Content:
    return make_tables()


@pytest.fixture(scope="module")
def folder(content: Content, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("data"), content)


def markers(figure: Figure, panel: int, model: str) -> list[float]:
    """Heights of the markers of a model, from left to right."""
    look = {**tables.LOOKS, errors.FORCE: errors.FORCE_LOOK}[model]
    lines = [line for line in figure.axes[panel].lines if line.get_marker() == look.marker]
    assert all(line.get_color() == look.colour for line in lines)
    return [float(np.asarray(line.get_ydata())[0]) for line in lines]


def test_markers_are_the_medians_of_every_fold(content: Content, folder: Path) -> None:
    runs = content["runs"]
    medians = runs.groupby(["split", "fold", "model"])["mse"].median()
    figure = errors.error_quartiles(folder)
    for panel, split in enumerate(("uniform", "factors")):
        for model in TOLD:
            expected = [medians[split, fold, model] for fold in FOLDS[split]]
            assert markers(figure, panel, model) == pytest.approx(expected)


def test_jumps_told_from_contact(folder: Path) -> None:
    figure = errors.errors_by_label(folder)
    told = 4  # the panel of the uniform shares in the third row
    assert markers(figure, told, "tau1") == pytest.approx([100.0 * 10 / 12] * 3)
    assert markers(figure, told, "tau4") == pytest.approx([100.0] * 3)
    assert markers(figure, told, errors.FORCE) == pytest.approx([100.0 * 11 / 12] * 3)
    assert markers(figure, 0, errors.FORCE) == []  # it predicts no detachment


def test_false_alarms_and_missed_jumps_are_counted_and_marked(folder: Path) -> None:
    figure = maxima.mean_maxima(folder)
    titles = [axes.get_title().splitlines() for axes in figure.axes]
    assert titles[0] == [tables.SHORT["tau1"], "1 false, 1 missed"]
    assert {counts for _, counts in titles[1:6]} == {"0 false, 0 missed"}
    right, false, missed = (len(dots.get_offsets()) for dots in figure.axes[0].collections)
    assert (right, false, missed) == (10, 1, 1)


def test_every_row_of_maxima_says_how_many_runs_were_tested(folder: Path) -> None:
    figure = maxima.mean_maxima(folder)
    rows = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert rows == ["stroke H unseen,\n12 runs", "rise β unseen,\n12 runs"]


def test_columns_say_what_predicts(content: Content, folder: Path, tmp_path: Path) -> None:
    titles = [axes.get_title() for axes in trajectories.predicted_detachment(folder).axes[:2]]
    assert titles == ["networks", "with a simulation of impacts"]
    alone = write(tmp_path, networks_only(content))
    assert {axes.get_title() for axes in trajectories.predicted_detachment(alone).axes} == {"networks", ""}


def test_a_simulation_shows_where_the_network_on_top_changes_nothing(folder: Path) -> None:
    lines = trajectories.predicted_detachment(folder).axes[1].lines
    order = {line.get_color(): line.get_zorder() for line in lines}
    assert order[tables.LOOKS["bounce"].colour] > order[tables.LOOKS["tau4_bounce"].colour]


def test_lines_are_the_quartiles_of_the_change(content: Content, folder: Path) -> None:
    runs = content["runs"]
    jumps = runs[runs["label"] == "jump"].set_index(["split", "fold", "model", "exp"])["mse"].sort_index()
    change = jumps["scarce", "5%", "tau2_blind"] - jumps["uniform", "5%", "tau2"]
    axes = settings.without_settings(folder).axes[1]
    lines = [float(np.asarray(line.get_xdata())[0]) for line in axes.lines]
    assert lines == pytest.approx(change.quantile([0.25, 0.5, 0.75]).tolist())
    assert sum(bar.get_height() for bar in axes.patches) == len(change)  # type: ignore[attr-defined]


def test_the_run_of_medium_detachment_is_shown(content: Content, folder: Path) -> None:
    assert example.shown_run(content["phi"]) == 4
    assert "V = 10 V" in example.jump_with_inputs(folder).get_suptitle()


def test_the_areas_add_up_to_the_line(folder: Path) -> None:
    for axes in example.contributions_over_time(folder).axes:
        areas = [area.get_paths()[0].vertices[:, 1] for area in axes.collections]
        half = len(areas) // 2
        top = np.max([area.max() for area in areas[:half]]) + np.min([area.min() for area in areas[half:]])
        line = np.asarray(axes.lines[-1].get_ydata())
        # all inputs have the same shape over time, so the extremes belong to one moment
        assert top == pytest.approx(line[np.argmax(np.abs(line))])


@pytest.mark.long
def test_bars_add_up_to_all_contributions(folder: Path) -> None:
    for axes in contributions.relative_contributions(folder).axes:
        assert sum(bar.get_width() for bar in axes.patches) == pytest.approx(100.0)  # type: ignore[attr-defined]


def test_the_legend_counts_networks_and_runs(folder: Path) -> None:
    legend = contributions.relative_contributions(folder).legends[0]
    assert [text.get_text() for text in legend.get_texts()] == [
        "DeepSHAP, 3 networks",
        "DeepSHAP, one network, 3 runs",
        "exact Shapley values of the same",
    ]


def test_the_range_of_an_input_stands_closer_together_than_to_the_next(folder: Path) -> None:
    heights = [float(text.xy[1]) for text in example.jump_with_inputs(folder).axes[-1].texts]  # type: ignore[attr-defined]
    low, high = heights[::2], heights[1::2]
    assert max(np.subtract(high, low)) < min(np.subtract(low[:-1], high[1:]))


def test_the_title_holds_the_share_of_the_settings(content: Content, folder: Path) -> None:
    overall = content["overall"]
    own = overall[(overall["model"] == "tau3") & overall["feature"].isin(SETTINGS)]
    share = 100.0 * own.groupby("repeat")["share"].sum().mean()
    assert (
        contributions.relative_contributions(folder).axes[2].get_title().endswith(f"settings {share:.0f} %")
    )


def test_the_parts_of_the_angle_are_added_up(content: Content) -> None:
    phi = content["phi"]
    phi = phi[(phi["model"] == "tau1") & (phi["exp"] == 2) & (phi["step"] == 7)]
    merged = tables.with_angle(phi, ["model", "step"]).set_index("feature")["phi"]
    parts = phi.set_index("feature")["phi"]
    assert merged["theta"] == pytest.approx(parts["sin(theta)"] + parts["cos(theta)"])
    assert set(merged.index) == {"theta", "omega", "alpha", *SETTINGS}
