"""What single figures of chapter 4 show is what small made-up tables of the slider-crank hold."""

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.figures.slider_crank import force, horizon, parameters, tables
from tests.figures.checks import Chapter, entries, write_tables

L1, L2, J1, M3, B_M, DT, LENGTH = 0.05, 0.29, 0.0034, 0.77, 0.007, 5e-4, 800
HORIZONS = (1, 10, 30, 100, 200, 300)
#: Typical error of a made-up model, rad/s.
MODELS = {
    "nnap": 0.8, "nnap_theta_omega": 1.0, "nnap_d_v_t": 0.9, "nnap_d": 2.0, "nnap_v": 9.0, "nnap_theta": 2.5,
    "nnap_omega": 8.0, "nnap_t": 12.0, "nnap_split": 0.9, "nnap_shooting": 0.6,
    "physics": 14.0, "black_box": 4.0,
}  # fmt: skip
ABOUT = [
    ("m1", "$m_1$", "mass of crank", "kg", 0.23, 0.235, np.nan, np.nan),
    ("m2", "$m_2$", "mass of connection rod", "kg", 0.35, 0.36, np.nan, np.nan),
    ("m3", "$m_3$", "mass of slider", "kg", 0.77, 0.80, 0.2, 1.6),
    ("l1", "$l_1$", "length of crank", "m", 0.05, 0.05, 0.025, 0.1),
    ("l2", "$l_2$", "length of connection rod", "m", 0.29, 0.292, np.nan, np.nan),
    ("J1", "$J_1$", "inertia of motor and crank", "kg m²", 0.0034, 0.0035, 0.001, 0.007),
    ("B_m", "$B_m$", "friction of the motor", "N m s/rad", 0.007, 0.0075, 0.0, 0.03),
]
Tables = dict[str, pd.DataFrame]


def spring(d: np.ndarray) -> np.ndarray:
    """Force of a spring that the slider meets at 0.02 m, N."""
    x = np.clip(np.asarray(d) - 0.02, 0.0, None)
    return 700.0 * x + 9e4 * x**3


def friction(v: np.ndarray) -> np.ndarray:
    """Dry and viscous friction of the slider, N."""
    return 9.0 * np.tanh(np.asarray(v) / 0.02) + 4.0 * np.asarray(v)


def position(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position of the slider, m, and its derivative with respect to the angle, m/rad."""
    q = np.sqrt(1.0 - (L1 / L2 * np.sin(theta)) ** 2)
    slope = -L1 * np.sin(theta) - L1**2 / L2 * np.sin(theta) * np.cos(theta) / q
    return L1 * np.cos(theta) + L2 * q - (L2 - L1), slope


def campaign(name: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Ten torques from two starts each on a crank with a spring and friction, explicit Euler steps."""
    profiles = np.repeat(np.arange(1, 11), 2)
    starts = np.tile([0.5 * np.pi, 1.25 * np.pi], 10)
    t = DT * np.arange(LENGTH)
    phase = 2.0 * np.pi * t[:, None] * (1.5 + 0.45 * profiles)
    T = (0.6 + 0.35 * profiles) * np.where(profiles % 3 == 0, np.sign(np.sin(phase)), np.sin(phase)) + 0.4
    theta, omega = starts.copy(), np.zeros(20)
    log = np.empty((LENGTH, 4, 20))
    for k in range(LENGTH):
        d, slope = position(theta)
        v = slope * omega
        log[k] = theta, omega, d, v
        F = spring(d) * (name == "spring") + friction(v)
        omega = omega + DT * (T[k] - B_M * omega - slope * F) / (J1 + M3 * slope**2)
        theta = theta + DT * omega
    ids = [f"T{p}{'ab'[i % 2]}" for i, p in enumerate(profiles)]
    speed = np.sqrt(np.mean(log[:, 1] ** 2, axis=0))
    columns = {"id": ids, "profile": profiles, "start": starts, "speed": speed}
    experiments = pd.DataFrame({"campaign": name, **columns, "slow": speed <= np.median(speed)})
    signals = [
        pd.DataFrame(log[..., j], columns=["theta", "omega", "d", "v"]).assign(id=i, t=t, T=T[:, j])
        for j, i in enumerate(ids)
    ]
    return experiments, pd.concat(signals, ignore_index=True).assign(campaign=name)


def predictions(experiments: pd.DataFrame, signals: pd.DataFrame, rng: np.random.Generator) -> Tables:
    """Errors and free runs of every model, plain and after the study of the horizon."""
    ids = experiments["id"].tolist()
    fast = set(experiments.loc[~experiments["slow"], "id"])
    omega = {i: run["omega"].to_numpy() for i, run in signals.groupby("id")}
    t = DT * np.arange(LENGTH)
    horizon_of = {"nnap_shooting": 100}
    cells = [(m, "leave_one_out", horizon_of.get(m, 1), False, scale) for m, scale in MODELS.items()]
    cells += [("nnap", "slow", 1, False, 2.4)]
    cells += [("nnap", "leave_one_out", N, True, 0.8 - 0.06 * np.log(N)) for N in HORIZONS]
    errors, examples = [], []
    for model, split, N, extra, scale in cells:
        about = {"model": model, "split": split, "horizon": N, "extra": extra}
        for i in sorted(fast) if split == "slow" else ids:
            fold = "I1" if split == "slow" else i
            for repeat in range(2):
                rmse = scale * rng.lognormal(0.0, 0.5)
                diverged = model == "nnap_t" and rng.random() < 0.2
                row = {**about, "fold": fold, "repeat": repeat, "id": i, "diverged": diverged}
                errors.append({**row, "rmse": np.nan if diverged else rmse})
            drift = 4.0 * scale * (t / 0.2) * np.sin(25.0 * t * rng.uniform(0.5, 1.5) + rng.uniform(0, 6))
            run = {"t": t, "omega_measured": omega[i], "omega": omega[i] + drift}
            examples.append(pd.DataFrame(run).assign(**about, fold=fold, id=i))
    return {"errors": pd.DataFrame(errors), "examples": pd.concat(examples, ignore_index=True)}


def histories(rng: np.random.Generator) -> pd.DataFrame:
    """Parameters that approach their value, except for a pair whose product stays as it is."""
    known = {row[0]: row for row in ABOUT}
    epochs = np.arange(0, 301, 5)
    sets = {
        "m3_J1_Bm": ("m3", "J1", "B_m"),
        "l1_J1_Bm": ("l1", "J1", "B_m"),
        "l1_m3_J1_Bm": ("l1", "m3", "J1", "B_m"),
    }
    rows = []
    for (name, members), fold in product(sets.items(), range(10)):
        tilt = rng.normal(0.0, 0.3)
        for member in members:
            truth = known[member][5]
            ambiguous = name.startswith("l1_m3") and member in ("l1", "m3")
            aim = truth * (np.exp({"l1": tilt, "m3": -tilt}[member]) if ambiguous else rng.normal(1.0, 0.03))
            value = aim + (truth * rng.uniform(0.5, 1.5) - aim) * np.exp(-epochs / rng.uniform(30, 70))
            run = {"set": name, "fold": f"T{fold + 1}a", "repeat": 0, "epoch": epochs, "parameter": member}
            rows.append(pd.DataFrame({**run, "value": value}))
    return pd.concat(rows, ignore_index=True)


def efforts(signals: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Networks near the true load after training, near nothing before."""
    rows = []
    for (name, log), model, stage in product(
        signals.groupby("campaign"), ("nnap", "nnap_split"), ("initial", "converged")
    ):
        log = log.iloc[::2]
        d, v = log["d"].to_numpy(), log["v"].to_numpy()
        F_c = spring(d) * (name == "spring") * 0.97 + 1.0
        F_nc = friction(v) + rng.normal(0.0, 0.5, len(v))
        if stage == "initial":
            F_c, F_nc = 0.5 + 10.0 * d, 0.4 * v
        parts = {"F_c": F_c, "F_nc": F_nc} if model == "nnap_split" else {"F_c": np.nan, "F_nc": np.nan}
        truth = spring(d) * (name == "spring") + friction(v)
        about = {"campaign": name, "model": model, "stage": stage, "id": log["id"], "t": log["t"]}
        rows.append(pd.DataFrame({**about, "d": d, "v": v, "F": F_c + F_nc, **parts, "F_true": truth}))
    return pd.concat(rows, ignore_index=True)


def networks(log: pd.DataFrame) -> Tables:
    """A force on a grid before and after training, and a formula for it on the states of `log`."""
    d, v = (x.ravel() for x in np.meshgrid(np.linspace(0.0, 0.1, 31), np.linspace(-2.0, 2.0, 33)))
    trained, untrained = spring(d) + friction(v), 30.0 * (d - 0.03) + 0.6 * np.maximum(0.0, v + 0.3)
    grid = pd.DataFrame({"d": d, "v": v})
    d_log, v_log = log["d"], log["v"]
    fit = 180.0 * d_log + 8.2e4 * d_log**3 + 9.0 * np.sign(v_log) + 4.0 * v_log
    learned = pd.DataFrame({"d": d_log, "v": v_log, "F": spring(d_log) + friction(v_log), "F_formula": fit})
    stages = {"initial": untrained, "converged": trained}
    surface = pd.concat([grid.assign(stage=stage, F=F) for stage, F in stages.items()])
    return {"surface": surface, "closed_form": learned.assign(formula="180 d + 82000 d³ + 9 sign(v) + 4 v")}


def sensitivities(rng: np.random.Generator) -> Tables:
    """Norms and correlations of sensitivities, and which sets of parameters can be identified."""
    names = ["F", *(row[0] for row in ABOUT)]
    samples = rng.normal(size=(60, len(names))) @ rng.normal(size=(len(names), len(names)))
    samples /= np.linalg.norm(samples, axis=0)
    pairs = product(enumerate(names), repeat=2)
    matrix = [(a, b, samples[:, i] @ samples[:, j]) for (i, a), (j, b) in pairs]
    sets = ("m3, J1, B_m", "l1, J1, B_m", "l1, m3, J1, B_m", "m3, J1", "l1, m3")
    together = ["l1, m3" in name for name in sets]
    advice = {
        "set": sets,
        "collinearity": [50.0 if bad else 3.0 for bad in together],
        "collinearity_with_network": [1e6 if bad else 6.0 for bad in together],
        "identifiable": [not bad for bad in together],
        "with_network": [not bad for bad in together],
    }
    norm = 10.0 ** np.array([2.9, 0.9, 1.9, 2.4, 2.8, 1.1, 2.7, 1.2])
    return {
        "sensitivity": pd.DataFrame({"name": names, "norm": norm}),
        "correlation": pd.DataFrame(matrix, columns=["row", "column", "correlation"]),
        "advice": pd.DataFrame(advice),
    }


def make_tables() -> Tables:
    """All tables, the same every time."""
    rng = np.random.default_rng(0)
    both = [campaign(name) for name in ("spring", "no_spring")]
    experiments, signals = (pd.concat(parts, ignore_index=True) for parts in zip(*both, strict=True))
    d = np.linspace(0.0, 0.1, 60)
    cells = product(HORIZONS, range(1, 6))
    timing = [(N, f"T{fold}a", 0.2 * N**0.85 * rng.lognormal(0.0, 0.05)) for N, fold in cells]
    about = ["parameter", "symbol", "meaning", "unit", "known", "truth", "low", "high"]
    return {
        "spring": pd.DataFrame({"d": d, "F": spring(d)}),
        "experiments": experiments,
        "signals": signals,
        **predictions(*both[0], rng),
        "timing": pd.DataFrame(timing, columns=["horizon", "fold", "seconds_per_epoch"]),
        "history": histories(rng),
        "parameters": pd.DataFrame(ABOUT, columns=about),
        "force": efforts(signals, rng),
        **networks(both[0][1]),
        **sensitivities(rng),
    }


def write(folder: Path, content: Tables) -> Path:
    """Tables where figures look for them; the data folder."""
    return write_tables(folder, "slider_crank", content)


def reduced(content: Tables) -> Tables:
    """Three models, two horizons, three folds, one campaign and one set; no T9 among the examples."""
    ids = ["T1a", "T4b", "T10a"]
    few = {name: table[table["id"].isin(ids)] for name, table in content.items() if "id" in table}
    for name in ("errors", "examples"):
        kept = few[name]["model"].isin(["nnap", "nnap_t", "physics"]) & few[name]["horizon"].isin([1, 30])
        few[name] = few[name][kept]
    few["errors"] = few["errors"][few["errors"]["repeat"] == 0]
    few["errors"].loc[few["errors"]["model"] == "nnap_t", ["rmse", "diverged"]] = np.inf, True
    for name in ("experiments", "signals", "force"):
        few[name] = few[name][few[name]["campaign"] == "spring"]
    few["force"] = few["force"].assign(F_true=np.nan)
    few["timing"] = content["timing"][content["timing"]["horizon"] == 30]
    few["history"] = content["history"][content["history"]["set"] == "m3_J1_Bm"]
    few["surface"] = content["surface"][content["surface"]["stage"] == "converged"]
    few["advice"] = content["advice"].head(1)
    return {**content, **few}


def nothing_trained(content: Tables) -> Tables:
    """Only plain models of two kinds, no history, no evaluated network."""
    plain = {name: content[name][~content[name]["extra"]] for name in ("errors", "examples")}
    two = {name: table[table["model"].isin(["nnap_d", "black_box"])] for name, table in plain.items()}
    return {**content, **two, "history": content["history"].head(0), "force": content["force"].head(0)}


def one_other_model(content: Tables) -> Tables:
    """A single model that none of the figures knows."""
    known = {name: content[name][content[name]["model"] == "nnap_split"] for name in ("errors", "examples")}
    return {**content, **{name: table.assign(model="another") for name, table in known.items()}}


CHAPTER = Chapter(("slider_crank",), make_tables, write, (reduced, nothing_trained, one_other_model))


def test_nine_tenths_of_the_most_accurate_runs_and_the_mean_of_those_that_end() -> None:
    rows = pd.DataFrame({"rmse": [*range(1, 20), np.nan], "diverged": [False] * 18 + [True] * 2})
    found = tables.accuracy(rows)
    assert (found.best, found.limit, found.mean, found.diverged) == (1.0, 18.0, 9.5, 2)
    assert tables.accuracy(rows.tail(3)).limit == np.inf
    assert np.isnan(tables.accuracy(rows.tail(2)).mean)


@pytest.mark.long
def test_the_gain_is_that_of_the_means(content: Tables, folder: Path) -> None:
    rows = content["errors"][content["errors"]["extra"]]
    means = rows.groupby("horizon")["rmse"].mean()
    best = means.drop(1).idxmin()
    change = f"−{100 * (1 - means[best] / means[1]):.0f} % at N = {best}"
    assert change in horizon.horizon_length(folder).axes[0].get_title()


def test_the_fit_finds_the_exponent(content: Tables, tmp_path: Path) -> None:
    timing = content["timing"].assign(seconds_per_epoch=0.1 * content["timing"]["horizon"] ** 0.75)
    figure = horizon.horizon_length(write(tmp_path, {**content, "timing": timing}))
    assert any("N^{0.75}" in text for text in entries(figure.axes[1].get_legend()))


def test_the_median_of_the_runs_is_drawn(content: Tables, folder: Path) -> None:
    history = content["history"]
    mine = history[(history["set"] == "m3_J1_Bm") & (history["parameter"] == "m3")]
    expected = mine[mine["epoch"] == mine["epoch"].max()]["value"].median()
    panel = next(axes for axes in parameters.convergence(folder).axes if "m_3" in axes.get_ylabel())
    assert expected in [np.asarray(line.get_ydata(), float)[-1] for line in panel.lines]


def test_the_formula_stands_above_its_figure(content: Tables, folder: Path) -> None:
    assert content["closed_form"]["formula"].iloc[0] in force.closed_form(folder).get_suptitle()


def test_the_example_is_the_dissertations_where_it_is_on_file() -> None:
    assert tables.example(["T10a", "T9a", "T9b"]) == "T9a"
    assert tables.example(["T10b", "T2a"]) == "T2a"
