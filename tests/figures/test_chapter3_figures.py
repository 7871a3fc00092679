"""What single figures of chapter 3 show is what small made-up tables of the wet clutch hold."""

import json
from itertools import combinations, product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from pipeline.figures.clutch import accuracy, data, densities, identification, points, tables
from tests.figures.checks import Chapter, entries, write_tables

CAMPAIGNS = ("clutch", "clutch_sharp")
METHODS = ("gaussian", "maximum_entropy", "push_forward")
SAMPLING = ["campaign", "alpha_of", "rule", "samples", "repeat", "mae"]
MADE = (*METHODS, "gaussian_sampled", "maximum_entropy_sampled")
NAMES = ("mu_1", "mu_2", "sigma_1", "sigma_2")
PLANTED = dict(zip(NAMES, (0.9, 0.55, 0.08, 0.046), strict=True))
MOMENTS = ["degree", "order", "moment", "source", "value", "truth"]
RATIO = 2.5
ABOUT = {"shown": "E5", "demo": [1.0, 1.0, 0.07, 0.02], "planted": [*PLANTED.values()]}
Content = dict[str, Any]  # tables by name, and about.json as `about`


def bell(y: np.ndarray, mean: float, std: float) -> np.ndarray:
    """Density of the normal distribution."""
    return np.exp(-0.5 * ((y - mean) / std) ** 2) / (std * np.sqrt(2.0 * np.pi))


def operating_points() -> pd.DataFrame:
    """Eight current profiles, each with two speeds and two brake torques."""
    settings = product((0.1, 0.2), (0.1, 0.15), (0.12, 0.23), (1200.0, 1500.0), (10.0, 60.0))
    table = pd.DataFrame(settings, columns=["u1", "u2", "u3", "rpm", "T_b0"])
    table["profile"] = np.repeat(np.arange(1.0, 9.0), 4)
    return table.assign(id=[f"E{i}" for i in range(1, len(table) + 1)])


def example_tables(rng: np.random.Generator) -> Content:
    """Densities, coefficients, moments and fits of the response arctan(theta)."""
    theta, y = np.linspace(-2.0, 5.0, 60), np.linspace(-0.8, 2.5, 60)
    draws = rng.uniform(-2.0, 5.0, 20)
    orders = [(q, i) for q in (2, 4, 8) for i in range(min(q, 6))]
    coefficients = [(q, i, 1.0 / (1 + i) + 0.1 / q, 1.0 / (1 + i)) for q, i in orders]
    cells = [(d, q) for d in (2, 3) for q in (3, 4, 8) if q > d]
    moments = [
        (d, q, m, source, m * (1.0 + (-1) ** q * 0.1 ** (q / 2)), float(m))
        for (d, q), m, source in product(cells, (1, 2, 3, 4), ("coefficients", "sampled"))
    ]
    fits = [
        (d, q, name, 0.11 / (1 + d + k), False)
        for (d, q), (k, name) in product([(0, 0), *cells], enumerate(METHODS[:2]))
    ]
    kinds = ("exact", "gaussian", "maximum_entropy", "gaussian_reference", "maximum_entropy_reference")
    given = {"theta": theta, "response": np.arctan(theta), "density_of_theta": bell(theta, 0.0, 2.0)}
    return {
        "example_densities": pd.DataFrame({**given, "y": y, "density_of_y": bell(y, 0.6, 0.8)}),
        "example_draws": pd.DataFrame({"theta": draws, "y": np.arctan(draws)}),
        "example_coefficients": pd.DataFrame(coefficients, columns=["order", "index", "value", "truth"]),
        "example_moments": pd.DataFrame(moments, columns=MOMENTS),
        "example_fits": pd.DataFrame(fits, columns=["degree", "order", "density", "emd", "fallback"]),
        "example_curves": pd.DataFrame({"y": y, **{k: bell(y, 0.6, 0.6 + 0.1 * len(k) / 20) for k in kinds}}),
    }


def bench_tables(experiments: pd.DataFrame) -> Content:
    """Current signals, and an engagement that is synchronous from 1.2 s on."""
    t = np.linspace(0.0, 4.0, 201)
    signals = []
    for p, row in experiments.groupby("profile").first().iterrows():
        u = np.where(t < row.u1, 0.35, np.minimum(row.u2 + row.u3 * t, 0.6))
        signals.append(pd.DataFrame({"profile": int(p), "t": t, "u": u}))
    z = np.clip(2e-3 * (t - 0.2), 0.0, 2e-3)
    joined = t >= 1.2
    omega_1 = np.where(joined, 90.0, 140.0 - 40.0 * t)
    run = {
        "t": t,
        "p": 1e5 * (1.0 + t),
        "measured_p": 1.02e5 * (1.0 + t),
        "z": z,
        "p_plates": 1e5 * (1.0 + t) * (z > 1.5e-3),
        "delta_t": np.clip((z - 1.4e-3) / 2e-4, 0.0, 1.0),
        "omega_1": omega_1,
        "omega_2": np.where(joined, omega_1 / RATIO, 20.0 * t),
        "measured_omega_1": omega_1 + 0.5,
        "measured_omega_2": 21.0 * t,
        "T_c": 40.0 * t,
        "T_1": 30.0 * t,
        "T_b": 60.0 + 0.0 * t,
        "synchronous": joined,
    }
    return {"currents": pd.concat(signals, ignore_index=True), "engagement": pd.DataFrame(run)}


def propagated_tables(experiments: pd.DataFrame, rng: np.random.Generator) -> Content:
    """Densities around a time of every operating point, their distances and log-likelihoods."""
    centre = 1.0 + 0.3 * rng.random(len(experiments))
    grid = np.linspace(-0.3, 0.3, 40)
    curves, rows, observed = [], [], []
    for campaign, of in product(CAMPAIGNS, (*METHODS, "demo")):
        for name, mean in zip(experiments["id"], centre, strict=True):
            own = {m: bell(grid, 0.01 * k, 0.06) for k, m in enumerate(("monte_carlo", *MADE))}
            base = {"campaign": campaign, "alpha_of": of, "id": name}
            curves.append(pd.DataFrame({**base, "y": mean + grid, **own}))
            reference = float(rng.normal(1.5, 0.5))
            for k, method in enumerate(MADE):
                error = float(rng.normal(0.0, 0.1))
                row = {**base, "method": method, "emd": 0.001 * (1 + k % 3) * rng.uniform(0.9, 1.1)}
                rows.append({**row, "error": error, "reference": reference, "fallback": False})
    for campaign in CAMPAIGNS:
        y = centre + rng.normal(0.0, 0.05, len(centre))
        base = {"campaign": campaign, "id": experiments["id"], "y": y, "deterministic": centre}
        observed.append(pd.DataFrame(base))
    x, z = (a.ravel() for a in np.meshgrid(np.linspace(0.7, 1.3, 9), np.linspace(0.4, 1.15, 9)))
    surface = pd.DataFrame({"p_hc0": x, "z_p": z, "y": 0.5 + 0.6 * x + 0.2 * z**2})
    return {
        "densities": pd.concat(curves, ignore_index=True),
        "monte_carlo": pd.DataFrame(rows),
        "points": pd.concat(observed, ignore_index=True),
        "response": pd.concat([surface.assign(campaign=c) for c in CAMPAIGNS], ignore_index=True),
    }


def identified_tables(experiments: pd.DataFrame, rng: np.random.Generator) -> Content:
    """Estimates of three methods, profiles of which that of sigma_2 ends at a bound, six data sets."""
    wide = {name: 0.1 * value for name, value in PLANTED.items()}

    def near(name: str) -> float:
        return float(PLANTED[name] + wide[name] * rng.normal())

    estimates, profiles, pairs, identified, replicates, errors = [], [], [], [], [], []
    for campaign in CAMPAIGNS:
        for method, name in product(METHODS, NAMES):
            limits = [np.nan, np.nan]
            if method == "push_forward":
                limits = [PLANTED[name] - 2 * wide[name], PLANTED[name] + 2 * wide[name]]
                limits = [np.nan, limits[1]] if name == "sigma_2" else limits
            estimates.append((campaign, method, name, near(name), False, *limits))
        for name in NAMES:
            share = np.linspace(-1.0 if name == "sigma_2" else -3.0, 3.0, 9)
            values = PLANTED[name] + wide[name] * share
            columns = {"campaign": campaign, "name": name, "value": values, "deviance": share**2}
            profiles.append(pd.DataFrame(columns))
        for first, second in combinations(NAMES, 2):
            a, b = (s.ravel() for s in np.meshgrid(np.linspace(-3, 3, 7), np.linspace(-3, 3, 7)))
            base = {"campaign": campaign, "first": first, "second": second, "deviance": a**2 + b**2 + a * b}
            x, y = PLANTED[first] + wide[first] * a, PLANTED[second] + wide[second] * b
            pairs.append(pd.DataFrame({**base, "x": x, "y": y}))
        for k in range(7):
            for method in METHODS:
                row = {"campaign": campaign, "data_set": k, "method": method}
                identified.append({**row, **{name: near(name) for name in NAMES}})
            replicates.append({"campaign": campaign, "data_set": k, **{name: near(name) for name in NAMES}})
            for of, (j, method) in product(METHODS[:2], enumerate(METHODS[:2])):
                base = {"campaign": campaign, "data_set": k, "alpha_of": of, "method": method}
                emd = 0.004 * (1 - 0.5 * j) * np.ones(len(experiments))
                errors.append(pd.DataFrame({**base, "id": experiments["id"], "emd": emd, "error": 0.1}))
    columns = ["campaign", "method", "name", "value", "at_bound", "low", "high"]
    return {
        "estimates": pd.DataFrame(estimates, columns=columns),
        "profiles": pd.concat(profiles, ignore_index=True),
        "pairs": pd.concat(pairs, ignore_index=True),
        "identified": pd.DataFrame(identified),
        "replicates": pd.DataFrame(replicates),
        "accuracy": pd.concat(errors, ignore_index=True),
    }


def make_tables() -> Content:
    """All tables, the same every time."""
    rng = np.random.default_rng(0)
    experiments = operating_points()
    sampling = [
        (c, of, rule, size, k, 1.5 * size**-0.5 * rng.lognormal(0.0, 0.1))
        for c, of, size in product(CAMPAIGNS, METHODS[:2], (25, 100, 400))
        for rule, k in (("even", 0), *(("random", k) for k in range(3)))
    ]
    return {
        **example_tables(rng),
        "experiments": experiments,
        **bench_tables(experiments),
        **propagated_tables(experiments, rng),
        **identified_tables(experiments, rng),
        "sampling": pd.DataFrame(sampling, columns=SAMPLING),
        "about": {name: {**ABOUT, "samples": 20000, "data_sets": 6, "truth": True} for name in CAMPAIGNS},
    }


def write(folder: Path, content: Content) -> Path:
    """Tables where figures look for them; the data folder."""
    tables = {name: table for name, table in content.items() if name != "about"}
    data = write_tables(folder, "clutch", tables)
    (data / "tables" / "clutch" / "about.json").write_text(json.dumps(content["about"]))
    return data


def users_own(content: Content) -> Content:
    """One campaign without withheld truth and without a shown distribution; the surface is counted."""
    less = {n: t[t["campaign"] == "clutch"] if "campaign" in t else t for n, t in content.items()}
    for name in ("densities", "monte_carlo"):
        less[name] = less[name][less[name]["alpha_of"] != "demo"]
    for name in ("identified", "accuracy"):
        less[name] = less[name][less[name]["data_set"] == 0]
    return {**less, "about": {"clutch": {**ABOUT, "samples": 100, "truth": False, "simulations": 121}}}


def one_method(content: Content) -> Content:
    """Nothing of maximum entropy, no evenly spread samples, a pair and a profile only."""
    less = dict(content)
    for column, names in {
        "alpha_of": ("densities", "monte_carlo", "sampling", "accuracy"),
        "method": ("accuracy", "estimates", "identified"),
        "density": ("example_fits",),
    }.items():
        less |= {name: less[name][less[name][column] != "maximum_entropy"] for name in names}
    less["sampling"] = less["sampling"][less["sampling"]["rule"] == "random"]
    less["pairs"] = less["pairs"][less["pairs"]["first"] == "sigma_1"]
    less["profiles"] = less["profiles"][less["profiles"]["name"] == "sigma_2"]
    return less


def nothing_found(content: Content) -> Content:
    """No pairs, no data sets drawn again; the simulated shafts never meet; one speed and one brake torque."""
    experiments = content["experiments"]
    kept = experiments[(experiments["rpm"] == 1200.0) & (experiments["T_b0"] == 10.0)]
    less = {n: t[t["id"].isin(kept["id"])] if "id" in t else t for n, t in content.items()}
    less["pairs"], less["accuracy"] = content["pairs"].head(0), less["accuracy"].head(0)
    less["replicates"] = content["replicates"].head(0)
    less["engagement"] = content["engagement"].assign(synchronous=False)
    return {**less, "about": {}}


CHAPTER = Chapter(("clutch",), make_tables, write, (users_own, one_method, nothing_found))


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
    for place, known in ((folder, True), (write(tmp_path, users_own(content)), False)):
        shown = entries(identification.estimates_of_data_sets(place).legends[0])
        assert ("withheld truth" in shown) is known


def test_the_surface_is_marked_at_its_simulations(content: Content, folder: Path, tmp_path: Path) -> None:
    own = write(tmp_path, users_own(content))
    one, other = (" ".join(entries(accuracy.sample_density(data).legends[0])) for data in (own, folder))
    assert "exact push-forward, 121 simulations" in one and "exact push-forward," not in other


def test_the_mean_reduction_of_the_distance_is_marked(folder: Path) -> None:
    right = accuracy.mean_distances(folder).axes[-1]
    marks = [np.asarray(line.get_xdata())[0] for line in right.lines if line.get_marker() == "|"]
    assert marks == pytest.approx([50.0] * 4)


def test_the_gear_ratio_is_that_of_the_joined_shafts(folder: Path) -> None:
    shown = entries(data.torques_and_speeds(folder).axes[1].get_legend())
    assert any(f"R = {RATIO:.2f}" in text for text in shown)
    assert any("simulated: 1.200 s" in text for text in shown)


def test_two_significant_digits_of_small_deviations() -> None:
    assert tables.alpha_text((0.936, 0.45, 0.0826, 0.0023)) == "(0.94, 0.45, 0.083, 0.0023)"
