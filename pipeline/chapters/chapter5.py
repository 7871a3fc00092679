"""Numbers of chapter 5 (follower jumps, contributions of the inputs), and verdicts on its claims."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from pipeline.chapters.claims import Row, row
from pipeline.chapters.leaves import mean_leaf
from pipeline.chapters.summary import leaf, share
from pipeline.chapters.verdicts import DIRECTION, FAILS, HOLDS, falling_verdict, order_verdict, worst
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput

_row = partial(row, 5)

#: Where a single number stands for a model: the share of the runs of Fig. 5.15, 5.17 and 5.18.
SCARCE = "5%"
UNIFORM, FACTORS = "uniform", "factors"
#: The split of the models without q_s.
WITHOUT = "scarce"
BOUNCE, HYBRID = "bounce", "tau4_bounce"
PROTOCOL = {
    UNIFORM: "trained on a random share of the contact and jump runs, tested on all others",
    "split": "trained on the 1st, 3rd, ... of the sorted levels of a factor, tested on the others; the text "
    "does not say which were left out",
    "baseline": f"bounce: physics alone, its parameters from the training runs, {SCARCE} of the runs where "
    "no other fold is named; F-dagger: a jump where its minimum at 2 kHz is negative, nothing fitted, on the "
    "same test runs",
    "hybrid": f"the network on top of the bounce simulator; {SCARCE} of the runs where no other fold is "
    "named",
    "attribution": "networks trained on 30% of the runs; DeepSHAP of jump runs that were not trained on, "
    "against contact runs that were; shares of the sum of |Phi| over steps and runs, mean and interval over "
    "repeats",
}
COMMON = (
    "100 Hz, first 2 s of a run; median prediction of the repeats; MSE per run, median over the jump runs "
    "(mse_jump) or all runs (mse_all) that were tested, interval by bootstrap over them; a run counts as a "
    "jump where the mean over revolutions of the largest predicted detachment, as a share of the stroke, "
    "exceeds a level, by logistic regression on the training runs; accuracy with its Wilson interval; "
    "stalls left out"
)


def splits(trained: "pd.Series[str]", folds: "pd.Series[str]") -> Array:
    """Return the experiment of every row (rows,): uniform, factors, or scarce for models without q_s."""
    experiment = np.where(folds.str.endswith("%"), UNIFORM, FACTORS)
    return np.where(trained == WITHOUT, WITHOUT, experiment)


def scores(runs: pd.DataFrame) -> dict[str, Any]:
    """Return mse_jump, mse_all and accuracy of one model on one fold."""
    jump = runs["label"] == "jump"
    found = {"mse_all": leaf(runs["mse"].to_numpy(), "mm^2")}
    found["accuracy"] = share(int((jump == runs["jumps"]).sum()), len(runs))
    # a tiny campaign may have no jump to test on
    return found | ({"mse_jump": leaf(runs.loc[jump, "mse"].to_numpy(), "mm^2")} if jump.any() else {})


def predictions(runs: pd.DataFrame) -> dict[str, Any]:
    """Return the numbers of the predictions: uniform, split, baseline.bounce and hybrid."""
    result: dict[str, Any] = {UNIFORM: {}, "split": {}, "baseline": {BOUNCE: {}}, "hybrid": {}}
    places = {BOUNCE: result["baseline"][BOUNCE], HYBRID: result["hybrid"]}
    for (split, fold, model), group in runs.groupby(["split", "fold", "model"]):
        section, level = ("split", fold) if split == FACTORS else (UNIFORM, fold.removesuffix("%"))
        found = scores(group)
        if model in places:
            places[model].setdefault(section, {})[level] = found
            if fold == SCARCE:
                places[model].update(found)
        else:
            result[section].setdefault(level, {})[model] = found
    for section, content in result.items():
        content["protocol"] = f"{PROTOCOL[section]}; {COMMON}"
    return result


def force_accuracy(runs: pd.DataFrame) -> dict[str, Any]:
    """Return the accuracy of F-dagger as a classifier of runs: a negative minimum is called a jump."""
    return share(int(((runs["f_min"] < 0.0) == (runs["label"] == "jump")).sum()), len(runs))


def attribution(tables: dict[str, pd.DataFrame]) -> dict[str, Any]:
    """Return the numbers of section 5.5."""
    accuracy = tables["accuracy"]
    error = 1e3 * float(accuracy["error"].max())
    # the rounding of another processor is another one
    bound = 10.0 ** np.ceil(np.log10(error)) if error else 0.0
    worst = {"value": float(bound), "unit": "mm", "n": int(accuracy["steps"].sum())}
    shares = {
        str(model): {
            str(feature): mean_leaf(rows["share"].to_numpy(), "-")
            for feature, rows in group.groupby("feature", sort=False)
        }
        for model, group in tables["overall"].groupby("model")
    }
    agreement = {
        str(model): {kind: mean_leaf(group[kind].to_numpy(), "-") for kind in ("shares", "trajectories")}
        for model, group in tables["agreement"].groupby("model")
    }
    return {
        "local_accuracy_max": worst,
        "share": shares,
        "rank_correlation": agreement,
        "protocol": PROTOCOL["attribution"],
    }


def readable(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per split, fold and model: the scores with their intervals."""
    rows = []
    for (split, fold, model), group in runs.groupby(["split", "fold", "model"], sort=False):
        row = {"split": split, "fold": fold, "model": model}
        for name, content in scores(group).items():
            low, high = content.get("interval", (None, None))
            row |= {name: content["value"], f"{name} low": low, f"{name} high": high}
        rows.append(row)
    return pd.DataFrame(rows)


RAW, FORCE, CAM, LINEAR = "tau1", "tau2", "tau3", "tau4"
INFORMED = (FORCE, CAM, LINEAR)
BLIND = "_blind"
SETTINGS = ("m", "H", "beta")
#: Inputs that are no physics: what the encoder says.
ENCODER = ("sin(theta)", "cos(theta)", "omega", "alpha")
#: Share of mistaken runs below which false estimates count as gone.
GONE = 0.01
#: The uniform fold with about as many training runs as the folds of the factors.
PLENTY = "50%"
TESTED = "median over jump test runs of the MSE of each repeat, one-sided Mann-Whitney test over repeats"


class Repeats:
    """Errors of single repeats: columns model, split, fold, repeat, label, mse (mm^2) and jumps."""

    def __init__(self, table: pd.DataFrame) -> None:
        jump = table["label"] == "jump"
        key = ["model", "fold", "repeat"]
        self._error = table[jump].groupby(key)["mse"].median()
        self._mistaken = (table["jumps"] != jump).groupby([table[k] for k in key]).mean()
        folds = table[["split", "fold"]].drop_duplicates()
        self.shares = sorted(
            folds.loc[folds["split"] == UNIFORM, "fold"], key=lambda fold: float(fold.removesuffix("%"))
        )
        self.factors = list(folds.loc[folds["split"] == FACTORS, "fold"])

    def error(self, model: str, fold: str = SCARCE) -> Array:
        """Return the median MSE over the jump test runs; gives (repeats,)."""
        return _per_repeat(self._error, model, fold)

    def mistaken(self, model: str, fold: str) -> Array:
        """Return the share of the test runs with a wrong label; gives (repeats,)."""
        return _per_repeat(self._mistaken, model, fold)

    def gain(self, fold: str) -> Array:
        """Return the error with raw data divided by the error with linear physics features, (repeats,)."""
        return self.error(RAW, fold) / self.error(LINEAR, fold)


def _per_repeat(numbers: "pd.Series[float]", model: str, fold: str) -> Array:
    if (model, fold) not in numbers.index:
        raise BadInput(f"there are no predictions of {model} on the fold {fold}, or no jumps among them")
    return np.asarray(numbers[model][fold], np.float64)


def claims(repeats: pd.DataFrame, overall: pd.DataFrame) -> list[Row]:
    """Return the claims of chapter 5 with their verdicts."""
    found = Repeats(repeats)
    return [
        _features(found),
        _scarce(found),
        _not_uniform(found),
        _false_jumps(found),
        _without_settings(found),
        _attribution(overall),
    ]


def _listed(values: dict[str, Array]) -> str:
    return ", ".join(f"{name} {np.median(v):.3g}" for name, v in values.items())


def _features(found: Repeats) -> Row:
    errors = {model: found.error(model) for model in (RAW, *INFORMED)}
    order = [(RAW, FORCE), (FORCE, CAM), (FORCE, LINEAR)]
    return _row(
        "features_lower_error",
        "fig. 5.16",
        "Every added physics feature lowers the error",
        dissertation="tau4 and tau3 < tau2 < tau1",
        ours=_listed(errors),
        unit="mm^2",
        protocol=f"trained on {SCARCE}; {TESTED}; tau1 over tau2, tau2 over tau3 and over tau4, the worst "
        "verdict",
        verdict=worst(*(order_verdict(errors[more], errors[less]) for more, less in order)),
    )


def _scarce(found: Repeats) -> Row:
    gains = {fold: found.gain(fold) for fold in found.shares}
    share = np.array([float(fold.removesuffix("%")) for fold in gains])
    # the repeats of a fold are of one draw of training runs: the folds are the samples
    verdict, correlation = falling_verdict(share, np.array([np.median(gain) for gain in gains.values()]))
    return _row(
        "scarce_data",
        "fig. 5.16",
        "Physics features help more where training data are scarce",
        dissertation="more pronounced",
        ours=_listed(gains),
        unit="error of tau1 / error of tau4, by share of the runs trained on",
        protocol="median over jump test runs of the MSE, median of the ratio over repeats; Spearman's rank "
        f"correlation of this median with the share, {correlation:.2f}; exact one-sided test over the "
        f"{len(share)} shares",
        verdict=verdict,
    )


def _not_uniform(found: Repeats) -> Row:
    folds = [*found.factors, PLENTY]
    gains = {fold: found.gain(fold) for fold in folds}
    return _row(
        "non_uniform_data",
        "fig. 5.16",
        "Physics features help more where training data leave out levels of a factor",
        dissertation="even more pronounced",
        ours=_listed(gains),
        unit="error of tau1 / error of tau4, by factor",
        protocol=f"against a uniform share of {PLENTY}, about as many training runs; {TESTED}; the worst "
        "verdict of the factors",
        verdict=worst(*(order_verdict(gains[fold], gains[PLENTY]) for fold in found.factors)),
    )


def _false_jumps(found: Repeats) -> Row:
    folds = [fold for fold in ("H", "beta") if fold in found.factors]
    raw = {fold: found.mistaken(RAW, fold) for fold in folds}
    informed = {fold: found.mistaken(LINEAR, fold) for fold in folds}
    fewer = worst(*(order_verdict(raw[fold], informed[fold]) for fold in folds))
    gone = all(np.median(rate) < GONE for rate in informed.values())
    return _row(
        "false_jumps",
        "fig. 5.17",
        "Jumps that are predicted in contact, and contact that is predicted in jumps, vanish with physics "
        "features",
        dissertation="fully diminished",
        ours=f"tau1 {_listed(raw)}; tau4 {_listed(informed)}",
        unit="share of the test runs that are mistaken",
        protocol="trained on every other level of H, or of beta; a jump where the mean maximum of the "
        "prediction, as a share of the stroke, exceeds a level chosen on the training runs; tested over "
        f"repeats; holds where less than {GONE:.0%} are left",
        verdict=worst(fewer, HOLDS if gone else DIRECTION),
    )


def _without_settings(found: Repeats) -> Row:
    models = (RAW, *INFORMED)
    ratios = {m: found.error(m + BLIND) / found.error(m) for m in models}
    worse = {m: order_verdict(found.error(m + BLIND), found.error(m)) for m in models}
    others = any(worse[m] == HOLDS for m in INFORMED)
    most = max(models, key=lambda m: float(np.median(ratios[m]))) == RAW
    return _row(
        "without_settings",
        "fig. 5.18",
        "Without q_s only the model of raw data deteriorates",
        dissertation="tau1 deteriorates, the others barely change",
        ours=_listed(ratios),
        unit="error without q_s / error with q_s",
        protocol=f"trained on {SCARCE}; {TESTED}; holds where tau1 is worse by this test and no other is, in "
        "direction where tau1 loses most",
        verdict=worst(worse[RAW], DIRECTION if most else FAILS) if others else worse[RAW],
    )


def _attribution(overall: pd.DataFrame) -> Row:
    def mass(model: str, names: tuple[str, ...]) -> Array:
        own = overall[(overall["model"] == model) & overall["feature"].isin(names)]
        return np.asarray(own.groupby("repeat")["share"].sum(), np.float64)

    settings = {model: mass(model, SETTINGS) for model in (RAW, *INFORMED)}
    physics = {m: 1.0 - settings[m] - (mass(m, ENCODER) if m != LINEAR else 0.0) for m in INFORMED}
    moved = worst(*(order_verdict(settings[RAW], settings[model]) for model in INFORMED))
    largest = all(np.median(share) > 0.5 for share in physics.values())
    return _row(
        "attribution_moves",
        "fig. 5.23",
        "Given physics features, the networks go by them instead of raw signals and q_s",
        dissertation="shifts to the physics-inspired features",
        ours=f"q_s: {_listed(settings)}; physics: {_listed(physics)}",
        unit="share of the sum of |Phi|",
        protocol="DeepSHAP of jump test runs against contact training runs, 30% of the runs trained on; the "
        "share of q_s falls from tau1 to each of the others, tested over repeats; holds where physics also "
        "has more than half",
        verdict=worst(moved, HOLDS if largest else DIRECTION),
    )
