"""What single figures of chapter 3 show is what the tables hold."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.figures.clutch import accuracy, data, densities, engagement, identification, points, tables
from tests.figures.clutch_tables import (
    NAMES,
    RATIO,
    Content,
    bell,
    make_tables,
    operating_points,
    users_own,
    write,
)


@pytest.fixture(scope="module")
def content() -> Content:
    return make_tables()


@pytest.fixture(scope="module")
def folder(content: Content, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("data"), content)


def test_every_operating_point_has_a_place_of_its_own() -> None:
    experiments = operating_points()
    where = points.places(Figure(), experiments)
    spots = {(id(place.axes), round(place.x, 6)) for place in where.values()}
    assert len(spots) == len(where) == len(experiments)
    low, high = where["E1"], where["E2"]
    assert low.axes is high.axes
    assert low.x < round(low.x) < high.x and (low.brake, high.brake) == (0, 1)


def test_an_area_stays_on_its_side_within_the_width_of_its_point() -> None:
    place = points.places(Figure(), operating_points())["E1"]
    y = np.linspace(0.5, 1.5, 50)
    density = bell(y, 1.0, 0.1)
    points.area(place, y, density, float(density.max()), (-1.0, 0.0), "k")
    x = np.concatenate([path.vertices[:, 0] for path in place.axes.collections[-1].get_paths()])
    assert x.max() <= place.x + 1e-9
    assert place.x - place.width / 2 <= x.min() < place.x - 0.4 * place.width


def test_the_title_holds_the_sums_of_the_log_likelihoods(content: Content, folder: Path) -> None:
    rows = content["monte_carlo"]
    mine = rows[(rows["campaign"] == "clutch") & (rows["alpha_of"] == "gaussian")]
    mine = mine[mine["method"] == "gaussian"]
    title = densities.gaussian_optimum(folder).get_suptitle()
    true = mine["reference"].sum()
    assert f"{true:.1f} by Monte Carlo (20 000 simulations" in title
    assert f"= {true + mine['error'].sum():.1f}," in title


def test_the_root_mean_square_of_the_first_campaign(content: Content, folder: Path) -> None:
    mine = content["points"][content["points"]["campaign"] == "clutch"]
    gap = mine["y"] - mine["deterministic"]
    title = data.deterministic_times(folder).get_suptitle()
    assert f"{1e3 * np.sqrt((gap**2).mean()):.0f} ms" in title


def test_an_interval_without_a_limit_ends_at_the_bound(content: Content, folder: Path) -> None:
    profiles = content["profiles"]
    bound = profiles.loc[profiles["name"] == "sigma_2", "value"].min()
    panels = dict(zip(NAMES, identification.profile_likelihoods(folder).axes, strict=True))
    dotted = {
        name: [float(np.asarray(line.get_xdata())[0]) for line in axes.lines if line.get_linestyle() == ":"]
        for name, axes in panels.items()
    }
    assert dotted == {"mu_1": [], "mu_2": [], "sigma_1": [], "sigma_2": [bound]}


def test_the_truth_is_drawn_only_where_it_is_known(content: Content, folder: Path, tmp_path: Path) -> None:
    def entries(data: Path) -> list[str]:
        return [
            text.get_text() for text in identification.estimates_of_data_sets(data).legends[0].get_texts()
        ]

    assert "withheld truth" in entries(folder)
    assert "withheld truth" not in entries(write(tmp_path, users_own(content)))


def test_the_surface_is_marked_at_its_simulations(content: Content, folder: Path, tmp_path: Path) -> None:
    def entries(data: Path) -> str:
        return " ".join(text.get_text() for text in accuracy.sample_density(data).legends[0].get_texts())

    assert "exact push-forward, 121 simulations" in entries(write(tmp_path, users_own(content)))
    assert "exact push-forward," not in entries(folder)


def test_the_mean_reduction_of_the_distance_is_marked(folder: Path) -> None:
    right = accuracy.mean_distances(folder).axes[-1]
    marks = [np.asarray(line.get_xdata())[0] for line in right.lines if line.get_marker() == "|"]
    assert marks == pytest.approx([50.0] * 4)


def test_the_gear_ratio_is_that_of_the_joined_shafts(folder: Path) -> None:
    legend = engagement.torques_and_speeds(folder).axes[1].get_legend()
    assert legend is not None
    shown = [text.get_text() for text in legend.get_texts()]
    assert any(f"R = {RATIO:.2f}" in text for text in shown)
    assert any("simulated: 1.200 s" in text for text in shown)


def test_two_significant_digits_of_small_deviations() -> None:
    assert tables.alpha_text((0.936, 0.45, 0.0826, 0.0023)) == "(0.94, 0.45, 0.083, 0.0023)"
