"""What single figures of follower jumps show is what a small made-up campaign and its tables hold."""

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from pipeline.figures.jumps import contributions, errors, example, settings_worth, tables
from tests.conftest import campaign_of
from tests.figures.checks import Chapter, entries, write_tables
from unmodelled.base.campaign import Campaign

Content = dict[str, pd.DataFrame]
SETTINGS = ("m", "H", "beta")
ENCODER = ("sin(theta)", "cos(theta)", "omega", "alpha")
INPUTS = {
    "tau1": (*ENCODER, *SETTINGS),
    "tau2": (*ENCODER, "F_dagger", *SETTINGS),
    "tau3": (*ENCODER, "F_dagger", "h", "dh", "d2h", *SETTINGS),
    "tau4": ("F_dagger", "h", "h_dot", "h_ddot", *SETTINGS),
}
TOLD = (*INPUTS, "bounce", "tau4_bounce")
FOLDS = {"uniform": ("5%", "30%", "50%"), "factors": ("H", "beta"), "scarce": ("5%",)}
LABELS = ("contact", "jump") * 6
STEPS = 40


def campaign() -> Campaign:
    """Twelve runs of 0.4 s, every other one a jump; the force F-dagger is wrong on the last one."""
    t = 0.01 * np.arange(STEPS)
    rows, logs = [], []
    for k, label in enumerate(LABELS):
        lowest = 2.0 if label == "contact" or k == len(LABELS) - 1 else -3.0
        rows.append({"label": label, "V": 7.0 + k, "m": 0.7, "H": 0.03, "beta": np.pi, "f_min": lowest})
        h, eps = 0.015 * (1.0 - np.cos(10.0 * t)), 1e-3 * k * np.sin(10.0 * t) ** 2
        log = {"t": t, "theta": 20.0 * t, "omega": 20.0 + t, "alpha": np.cos(t), "eps": eps, "h": h}
        others = ("dh", "d2h", "h_dot", "h_ddot")
        logs.append(
            log | {"F_dagger": lowest + 1.0 + np.sin(9.0 * t)} | {name: np.sin(9.0 * t) for name in others}
        )
    return campaign_of(rows, logs)


def predicted(rng: np.random.Generator) -> Content:
    """Errors and trajectories of every model on every fold; one network mistakes two runs."""
    runs, examples = [], []
    t = 0.01 * np.arange(STEPS)
    for split, folds in FOLDS.items():
        names = [name + "_blind" for name in INPUTS] if split == "scarce" else TOLD
        for fold, (j, model) in product(folds, enumerate(names)):
            for k, label in enumerate(LABELS):
                height, jump = (3e-3, True) if label == "jump" else (3e-5, False)
                # the raw network takes one run of either kind for the other
                mistaken = model == "tau1" and k < 2
                run = {"split": split, "fold": fold, "model": model, "exp": k + 1, "label": label}
                run |= {"measured": height, "predicted": height * rng.lognormal(0.0, 0.2)}
                run["mse"] = rng.lognormal(-j, 1.0) * (3.0 if model == "tau1_blind" else 1.0)
                runs.append(run | {"jumps": jump != mistaken})
            for exp in (2, 4, 6, 1):
                measured = 1e-3 * exp * np.sin(10.0 * t) ** 2
                label = LABELS[exp - 1]
                base = {"split": split, "fold": fold, "model": model, "exp": exp, "label": label, "t": t}
                curves = {"measured": measured, "predicted": (1.0 - 0.1 * j) * measured}
                examples.append(pd.DataFrame({**base, **curves, "low": 0.8 * measured, "high": measured}))
    return {"runs": pd.DataFrame(runs), "examples": pd.concat(examples, ignore_index=True)}


def explained(rng: np.random.Generator) -> Content:
    """Contributions of the inputs to what four networks say of three jumps."""
    phi, outputs, overall, exact, agreement, points = [], [], [], [], [], []
    step = np.arange(STEPS)
    for (model, names), exp in product(INPUTS.items(), (2, 4, 6)):
        parts = {name: 1e-3 * rng.normal() * np.sin(0.05 * step) for name in names}
        head = {"model": model, "exp": exp, "step": step}
        for name, own in parts.items():
            phi.append(pd.DataFrame({**head, "feature": name, "phi": own}))
            points.append(phi[-1].assign(value=np.cos(step) + 0.1 * exp, base=1e-5))
        outputs.append(pd.DataFrame({**head, "base": 1e-5, "output": 1e-5 + sum(parts.values())}))
        grouped = ["theta", *(name for name in names if name not in tables.ANGLE)]
        grouped = grouped if model != "tau4" else list(names)
        for method in ("deep_shap", "exact"):
            sizes = rng.uniform(0.1, 1.0, len(grouped))
            columns = {"feature": grouped, "magnitude": sizes, "share": sizes / sizes.sum()}
            exact.append(pd.DataFrame({"model": model, "exp": exp, "method": method, **columns}))
        agreement.append({"model": model, "exp": exp, "shares": 0.9, "trajectories": 0.8})
    for (model, names), repeat in product(INPUTS.items(), range(3)):
        share = rng.dirichlet(np.ones(len(names)))
        overall.append(pd.DataFrame({"model": model, "repeat": repeat, "feature": names, "share": share}))
    return {
        "phi": pd.concat(phi, ignore_index=True),
        "explained": pd.concat(outputs, ignore_index=True),
        "overall": pd.concat(overall, ignore_index=True),
        "exact": pd.concat(exact, ignore_index=True),
        "agreement": pd.DataFrame(agreement),
        "points": pd.concat(points, ignore_index=True),
    }


def make_tables() -> Content:
    """All tables, the same every time."""
    return predicted(rng := np.random.default_rng(0)) | explained(rng)


def write(folder: Path, content: Content) -> Path:
    """The campaign and the tables where figures look for them; the data folder."""
    campaign().write(folder / "features" / "cam_follower")
    return write_tables(folder, "jumps", content)


def networks_only(content: Content) -> Content:
    """No simulation of impacts and no factors; one network was not explained."""
    less = {name: table[~table["model"].str.contains("bounce")] for name, table in content.items()}
    for name in ("runs", "examples"):
        less[name] = less[name][less[name]["split"] != "factors"]
    for name in ("phi", "explained", "overall", "exact", "agreement", "points"):
        less[name] = less[name][less[name]["model"] != "tau4"]
    return less


def no_jump(content: Content) -> Content:
    """Only contact runs were tested; both ways of explaining say the same of everything."""
    less = {name: content[name][content[name]["label"] == "contact"] for name in ("runs", "examples")}
    return {**content, **less, "agreement": content["agreement"].assign(shares=np.nan, trajectories=np.nan)}


def nothing(content: Content) -> Content:
    return {name: table.head(0) for name, table in content.items()}


CHAPTER = Chapter(("jumps",), make_tables, write, (networks_only, no_jump, nothing))


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
    figure = errors.mean_maxima(folder)
    titles = [axes.get_title().splitlines() for axes in figure.axes]
    assert titles[0] == [tables.SHORT["tau1"], "1 false, 1 missed"]
    assert {counts for _, counts in titles[1:6]} == {"0 false, 0 missed"}
    right, false, missed = (len(dots.get_offsets()) for dots in figure.axes[0].collections)
    assert (right, false, missed) == (10, 1, 1)


def test_every_row_of_maxima_says_how_many_runs_were_tested(folder: Path) -> None:
    figure = errors.mean_maxima(folder)
    rows = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert rows == ["stroke H unseen,\n12 runs", "rise β unseen,\n12 runs"]


def test_columns_say_what_predicts(content: Content, folder: Path, tmp_path: Path) -> None:
    titles = [axes.get_title() for axes in example.predicted_detachment(folder).axes[:2]]
    assert titles == ["networks", "with a simulation of impacts"]
    alone = write(tmp_path, networks_only(content))
    assert {axes.get_title() for axes in example.predicted_detachment(alone).axes} == {"networks", ""}


def test_a_simulation_shows_where_the_network_on_top_changes_nothing(folder: Path) -> None:
    lines = example.predicted_detachment(folder).axes[1].lines
    order = {line.get_color(): line.get_zorder() for line in lines}
    assert order[tables.LOOKS["bounce"].colour] > order[tables.LOOKS["tau4_bounce"].colour]


def test_lines_are_the_quartiles_of_the_change(content: Content, folder: Path) -> None:
    runs = content["runs"]
    jumps = runs[runs["label"] == "jump"].set_index(["split", "fold", "model", "exp"])["mse"].sort_index()
    change = jumps["scarce", "5%", "tau2_blind"] - jumps["uniform", "5%", "tau2"]
    axes = settings_worth.without_settings(folder).axes[1]
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
    assert entries(contributions.relative_contributions(folder).legends[0]) == [
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
    title = contributions.relative_contributions(folder).axes[2].get_title()
    assert title.endswith(f"settings {share:.0f} %")


def test_the_parts_of_the_angle_are_added_up(content: Content) -> None:
    phi = content["phi"]
    phi = phi[(phi["model"] == "tau1") & (phi["exp"] == 2) & (phi["step"] == 7)]
    merged = tables.with_angle(phi, ["model", "step"]).set_index("feature")["phi"]
    parts = phi.set_index("feature")["phi"]
    assert merged["theta"] == pytest.approx(parts["sin(theta)"] + parts["cos(theta)"])
    assert set(merged.index) == {"theta", "omega", "alpha", *SETTINGS}
