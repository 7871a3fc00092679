"""The stages of chapter 5, run as the command line does with a profile that is tiny."""

from pathlib import Path
from typing import Any

import hydra
from omegaconf import DictConfig, OmegaConf

from pipeline.__main__ import PROGRAM

#: Enough to run everything, not to learn anything.
TINY = {"repeats": 2, "sequence_updates": 3, "bounce_members": 1}
TINY |= {"explained_runs": 3, "references": 4, "exact_runs": 1, "exact_references": 2}
BOTH = "uniform_and_factors"
CELLS = {BOTH: "detachment", "scarce": "detachment_blind"}
#: The shares that claims and explanations are about.
SHARES = "split.folds.shares=[0.05,0.3,0.5]"


def call(verb: str, *overrides: str, **paths: Path) -> None:
    """Run a stage as the command line does."""
    has_profile = "profile" in PROGRAM.choices(verb)
    tiny = [f"profile.{key}={value}" for key, value in TINY.items()] if has_profile else []
    few = [SHARES] if verb in ("attribute", "tabulate_jumps") else []
    few = [SHARES.replace("folds", "folds.parts.uniform.folds")] if f"split={BOTH}" in overrides else few
    config = PROGRAM.compose(verb, [*tiny, *few, *overrides, f"out={paths['out']}"])
    OmegaConf.resolve(config)
    arguments: dict[str, Any] = {
        str(key): hydra.utils.instantiate(value) if isinstance(value, DictConfig) else value
        for key, value in config.items()
        if key != "_target_"
    }
    hydra.utils.get_method(config["_target_"])(**arguments | paths)


def train(root: Path, model: str, split: str, out: Path | None = None) -> None:
    """Fit a model on the features below `root`."""
    words = f"model={model}", f"split={split}", f"model.features={root / 'features'}"
    call("train", *words, out=out or root / "fits" / model / split)


def evaluate(root: Path, model: str, split: str, out: Path | None = None) -> None:
    """Test the fits of a model below `root`."""
    words = f"model={model}", f"split={split}", f"model.features={root / 'features'}"
    fits = root / "fits" / model / split
    call("evaluate", *words, fits=fits, out=out or root / "predictions" / model / split)


def attribute(root: Path, *overrides: str, out: Path | None = None) -> None:
    """Explain the networks below `root`."""
    fits = root / "fits" / "detachment" / BOTH
    features = f"model.features={root / 'features'}"
    call("attribute", features, *overrides, fits=fits, out=out or root / "attributions")


def tabulate(root: Path, out: Path | None = None) -> None:
    """Make the tables of chapter 5 of all that is below `root`."""
    given = {name: root / name for name in ("features", "predictions", "attributions", "reports")}
    call("tabulate_jumps", **given, out=out or root / "tables")
