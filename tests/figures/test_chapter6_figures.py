"""Figures of chapter 6 on small made-up tables."""

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.chapters import boundary
from pipeline.figures import exploration, simulation
from pipeline.figures.palette import LOOKS, look, present
from tests.figures.checks import Chapter, write_tables
from unmodelled.base.campaign import Campaign

pytestmark = pytest.mark.long

#: Quality of the made-up models: error of the contact force per subset away from the training runs, N.
MODELS = {"lls": 1.2, "f_bb": 0.8, "f_h1": 0.4, "f_h2": 0.3, "motor": 0.05, "best": 0.03}
ONLY_ONCE = ("lls", "motor")
SMALL = {"repeats": 1, "strokes": 2, "voltages": 8}


def make_tables(
    data: Path, models: dict[str, float], repeats: int, strokes: int = 3, voltages: int = 10
) -> Path:
    """A campaign with a known boundary, and predictions of it that get worse away from the training runs."""
    rng = np.random.default_rng(0)
    factors = (np.linspace(0.01, 0.07, strokes), np.pi * np.array([0.5, 1.0, 1.5]), (0.7, 1.3))
    settings = product(*factors, np.linspace(3.6, 10.8, voltages))
    grid = pd.DataFrame(settings, columns=["H", "beta", "m", "V"])
    experiments = grid.assign(exp=np.arange(7, 7 + len(grid)))
    load = (grid["V"] / 7.2) ** 2 * (grid["H"] / 0.03) * (0.6 + 0.3 * grid["beta"] / np.pi)
    experiments["f_min"] = 9.0 * grid["m"] * (1.0 - load)
    experiments["label"] = np.where(experiments["f_min"] > 0, "contact", "jump")
    experiments["eps_share"] = 0.013 * np.exp(0.3 * -experiments["f_min"])
    contact = experiments[experiments["label"] == "contact"].sort_values("f_min", ascending=False).index
    experiments["subset"] = 0
    for number, rows in enumerate(np.array_split(contact, 10), start=1):
        experiments.loc[rows, "subset"] = number
    force = _force(experiments, models, repeats, rng)
    truth = boundary.measured(experiments, 0.013).assign(model="measured", fold="", repeat=0)
    lines = [truth]
    for key, group in force.groupby(["model", "fold", "repeat"]):
        Q = boundary.predicted(experiments, group["f_min"].to_numpy())
        lines.append(Q.assign(**dict(zip(("model", "fold", "repeat"), key, strict=True))))
    errors, examples = _simulations(data, experiments, models, repeats, rng)
    tuning = [
        (model, hidden, repeat, rng.lognormal(0.0, 0.3) / np.sqrt(hidden))
        for model, hidden, repeat in product(models, (8, 32, 128), range(repeats))
        if model.startswith("f_")
    ]
    tables = {
        "experiments": experiments,
        "force": force,
        "boundary": pd.concat(lines, ignore_index=True),
        "errors": errors,
        "examples": examples,
        "tuning": pd.DataFrame(tuning, columns=["model", "hidden", "repeat", "omega_mse"]),
    }
    return write_tables(data, "cam_follower", tables)


def _force(
    experiments: pd.DataFrame, models: dict[str, float], repeats: int, rng: np.random.Generator
) -> pd.DataFrame:
    tables = []
    for (model, scale), level in product({**models, "direct": 2.0}.items(), (1, 4, 8)):
        distance = np.where(experiments["subset"] > 0, experiments["subset"] - level, 11 - level).clip(0)
        for repeat in range(1 if model == "direct" else repeats):
            draw = rng.normal(0.0, 1.0) if model not in ONLY_ONCE else 0.5
            f_min = experiments["f_min"] + scale * distance * draw
            row = {"model": model, "split": "extrapolation", "fold": f"{10 * level}%", "repeat": repeat}
            tables.append(pd.DataFrame({"exp": experiments["exp"], "f_min": f_min}).assign(**row))
    return pd.concat(tables, ignore_index=True)


def _simulations(
    data: Path, experiments: pd.DataFrame, models: dict[str, float], repeats: int, rng: np.random.Generator
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Errors and examples, and the measured runs in data/features."""
    t = 0.01 * np.arange(150)
    theta = [v * (t - 0.2 * (1 - np.exp(-t / 0.2))) for v in 2.0 * experiments["V"]]
    omega = [np.gradient(a, t) * (1 + 0.2 * np.sin(a)) for a in theta]
    signals = {"t": np.tile(t, len(theta)), "theta": np.concatenate(theta), "omega": np.concatenate(omega)}
    offsets = np.arange(len(theta) + 1, dtype=np.int64) * len(t)
    Campaign(experiments, signals, offsets, {"data": "made up"}).write(data / "features" / "cam_follower")
    errors, examples = [], []
    for i, (exp, subset) in enumerate(zip(experiments["exp"], experiments["subset"], strict=True)):
        odd = subset - 1 + subset % 2
        jobs = [("interpolation", f"I{odd}-I{odd + 1}")] if subset else []
        jobs += [("extrapolation", f"{10 * k}%") for k in (1, 4, 8) if subset > 8]
        for (split, fold), (model, scale) in product(jobs, models.items()):
            row = {"model": model, "split": split, "fold": fold, "exp": exp}
            for repeat in range(repeats):
                mse = scale * rng.lognormal(0.0, 0.8)
                errors.append({**row, "repeat": repeat, "omega_mse": mse, "omega_mse_time": 4 * mse})
            if i % 9 == 0:
                run = {"t": t, "theta": (1 + 0.05 * scale) * theta[i], "omega": (1 + 0.05 * scale) * omega[i]}
                examples.append(pd.DataFrame(run).assign(**row))
    return pd.DataFrame(errors), pd.concat(examples, ignore_index=True)


CHAPTER = Chapter(
    ("simulation", "exploration"),
    lambda: {"models": MODELS, "repeats": 4},
    lambda folder, content: make_tables(folder, **content),
    (
        lambda _: {**SMALL, "models": {"f_h2": 0.3}},
        lambda _: {**SMALL, "models": {"motor": 0.1, "f_bb": 0.8, "another": 0.5}},
    ),
)


def read(folder: Path, name: str) -> pd.DataFrame:
    return pd.read_parquet(folder / "tables" / "cam_follower" / f"{name}.parquet")


def test_without_interpolation_the_figure_says_so(folder: Path, tmp_path: Path) -> None:
    both = {name: read(folder, name) for name in ("errors", "examples")}
    write_tables(tmp_path, "cam_follower", {n: t[t["split"] == "extrapolation"] for n, t in both.items()})
    for draw in (simulation.simulation_drift, simulation.interpolation_errors):
        assert any("no run" in text.get_text() for text in draw(tmp_path).axes[0].texts)


def test_title_shows_the_mean_error_of_the_clipped_forces(folder: Path) -> None:
    experiments, force = read(folder, "experiments"), read(folder, "force")
    first = force[(force["fold"] == "10%") & (force["model"] == "f_h2")]
    joined = experiments[experiments["subset"] >= 2].merge(first, on="exp", suffixes=("", "_hat"))
    error = (joined["f_min"].clip(lower=0) - joined["f_min_hat"].clip(lower=0)).abs()
    expected = np.median([group.mean() for _, group in error.groupby(joined["repeat"])])
    titles = [axes.get_title() for axes in exploration.predicted_contact_force(folder).axes]
    assert f"{look('f_h2').label}\nMAE {expected:.2f} N" in titles


def test_drift_is_cut_to_the_measured_run(folder: Path) -> None:
    figure = simulation.simulation_drift(folder)
    for left, right in zip(figure.axes[0::3], figure.axes[1::3], strict=True):
        for axes in (left, right):
            ends = [np.max(np.asarray(line.get_xdata(), float)) for line in axes.lines]
            assert max(ends) == ends[0]


def test_the_known_boundary_is_drawn(folder: Path) -> None:
    table = read(folder, "boundary")
    truth = table.loc[table["model"] == "measured", "Q"].to_numpy()
    lines = [line for axes in exploration.boundary_grid(folder).axes for line in axes.lines]
    drawn = [line.get_ydata() for line in lines if line.get_color() == look("measured").colour]
    values = np.concatenate(drawn, dtype=float)
    np.testing.assert_array_equal(np.sort(values[np.isfinite(values)]), np.sort(truth))


def test_models_keep_their_looks_and_their_order() -> None:
    colours = [style.colour for style in LOOKS.values()]
    markers = [style.marker for style in LOOKS.values()]
    assert len(set(colours)) == len(colours)
    assert len(set(markers)) == len(markers)
    table = pd.DataFrame({"model": ["measured", "zebra", "best", "f_bb"]})
    assert present(table) == ["f_bb", "best", "zebra"]
    assert look("zebra").label == "zebra"
