"""A small made-up campaign with follower jumps and the tables of what was predicted and explained of it."""

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.figures.jumps import tables
from tests.figures.checks import write_tables
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
        rows.append((k + 1, label, 7.0 + k, 0.7, 0.03, np.pi, lowest))
        h, eps = 0.015 * (1.0 - np.cos(10.0 * t)), 1e-3 * k * np.sin(10.0 * t) ** 2
        log = {"t": t, "theta": 20.0 * t, "omega": 20.0 + t, "alpha": np.cos(t), "eps": eps, "h": h}
        others = ("dh", "d2h", "h_dot", "h_ddot")
        logs.append(
            log | {"F_dagger": lowest + 1.0 + np.sin(9.0 * t)} | {name: np.sin(9.0 * t) for name in others}
        )
    columns = ["exp", "label", "V", "m", "H", "beta", "f_min"]
    signals = {name: np.concatenate([log[name] for log in logs]) for name in logs[0]}
    offsets = STEPS * np.arange(len(LABELS) + 1)
    return Campaign(pd.DataFrame(rows, columns=columns), signals, offsets, {"data": "virtual"})


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
                runs.append(
                    {
                        "split": split,
                        "fold": fold,
                        "model": model,
                        "exp": k + 1,
                        "label": label,
                        "measured": height,
                        "predicted": height * rng.lognormal(0.0, 0.2),
                        "mse": rng.lognormal(-j, 1.0) * (3.0 if model == "tau1_blind" else 1.0),
                        "jumps": jump != mistaken,
                    }
                )
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
        for name, own in parts.items():
            phi.append(pd.DataFrame({"model": model, "exp": exp, "step": step, "feature": name, "phi": own}))
            dots = {"phi": own, "value": np.cos(step) + 0.1 * exp, "base": 1e-5}
            points.append(pd.DataFrame({"model": model, "exp": exp, "step": step, "feature": name, **dots}))
        base = np.full(STEPS, 1e-5)
        output = base + sum(parts.values())
        outputs.append(
            pd.DataFrame({"model": model, "exp": exp, "step": step, "base": base, "output": output})
        )
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
    rng = np.random.default_rng(0)
    return predicted(rng) | explained(rng)


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
