"""Protocol of models for training and evaluation, behind the verbs `train` and `evaluate`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import pandas as pd

from unmodelled.base.errors import BadInput
from unmodelled.learning.splits import Fold, Split

Tables = dict[str, pd.DataFrame]


class Recipe(Protocol):
    """A model and its training, as a file of `conf/model/` describes them.

    A recipe knows where its data come from: a hybrid model of a system file takes `system` and `logs`; a
    recipe of another kind carries its own data in its attributes and refuses both.
    """

    def train(
        self,
        system: Path | None,
        logs: Path | None,
        split: Split,
        profile: Mapping[str, Any],
        start: Path | None,
        device: str,
        seed: int,
        out: Path,
    ) -> None:
        """Fit one model per fold and repeat of a split, and write them to the folder `out`.

        Args:
            system: path of the system file; None where the recipe carries its own data.
            logs: path of the log folder or of the store that ingest wrote; None as above.
            split: division of the experiments into folds; a model sees the training experiments of its fold.
            profile: numbers of repeats per fold: `repeats`, and `system_repeats` of models of system files.
            start: folder of a fit of the same model and split to continue from; None starts from scratch.
            device: `cpu` for the compiled kernels, or a device of torch such as `cuda`.
            seed: seed of the random generators.
            out: folder of the results: `fit.json` and the weights.

        Raises:
            BadInput: when the data are missing, too few, or do not suit the recipe.
        """
        ...

    def evaluate(self, system: Path | None, logs: Path | None, fits: Path, split: Split) -> Tables:
        """Predict the held-out experiments of every fold with the models that `train` wrote.

        Args:
            system: path of the system file; None where the recipe carries its own data.
            logs: path of the log folder or of the store that ingest wrote; None as above.
            fits: folder that `train` wrote for the same recipe and split.
            split: division of the experiments into folds.

        Returns:
            Tables by the name of the file that each becomes.

        Raises:
            BadInput: when an input is missing, or the fit belongs to another recipe or split.
        """
        ...


def required(system: Path | None, logs: Path | None) -> tuple[Path, Path]:
    """Return the system file and the log folder that a hybrid model of a system needs."""
    if system is None or logs is None:
        missing = [name for name, path in (("system", system), ("logs", logs)) if path is None]
        lack = f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing"
        raise BadInput(f"a hybrid model of a system needs system=... and logs=...: {lack}")
    return system, logs


def refused(system: Path | None, logs: Path | None, start: Path | None = None) -> None:
    """Refuse what only hybrid models of a system take, for a model that carries its own data.

    Examples:
        >>> refused(Path("pendulum.yaml"), None)
        Traceback (most recent call last):
        unmodelled.base.errors.BadInput: only hybrid models of a system take system=...: leave it out
    """
    paths = {"system": system, "logs": logs, "start": start}
    given = [f"{name}=..." for name, path in paths.items() if path is not None]
    if given:
        rest = "it" if len(given) == 1 else "them"
        taken = " and ".join(given)
        raise BadInput(f"only hybrid models of a system take {taken}: leave {rest} out")


def check_folds(folds: list[Fold], fitted: list[str], path: Path) -> None:
    """Refuse a fit of another split."""
    if fitted != [fold.name for fold in folds]:
        raise BadInput(f"{path}: was fitted on the folds {fitted}, another split")
