"""The result of a training: fitted hybrid models of a system, in memory and in a folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from unmodelled.base.arrays import Mask
from unmodelled.base.errors import BadInput
from unmodelled.base.files import replacing, replacing_folder, write_json
from unmodelled.base.notebook import shown
from unmodelled.base.ownership import writing
from unmodelled.base.parquet import read_parquet, write_parquet
from unmodelled.base.shapes import check_shape
from unmodelled.engine.compiled.structure import Augmented, Network
from unmodelled.engine.free_run import Integration
from unmodelled.learning.checkpoint import read_checkpoint, restore, save
from unmodelled.learning.nnap import Nnap
from unmodelled.learning.structures import network_inputs, texts_of
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System
from unmodelled.systems.reader import read_system
from unmodelled.systems.writer import write_system

NUMBERS = ("repeats", "seed", "horizon", "epochs", "seconds")
#: What `model.pt` says of the integration, and beside the weights.
INTEGRATION = {"period": float, "method": frozenset({"euler", "rk4"}), "substeps": int, "hold": float}
SHAPE = {
    **{"repeats": int, "seed": int, "horizon": int, "epochs": int, "seconds": float, "folds": [str]},
    **{"trained_on": {"*": [str]}, "trainable": [str], "diverged": [[(str, int)]]},
    "integration": INTEGRATION,
    "networks": [{"port": str, "inputs": [str], "hidden": int, "label": str}],
}


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """Fitted hybrid models of a system: one per fold and repeat of a split, as one stack.

    Attributes:
        model: stack of the fitted models, the repeats of the first fold first.
        integration: integration of the free runs that the models were trained with.
        trained_on: ids of the training experiments by the name of the fold.
        repeats: number of models per fold, which differ in their random start.
        seed: seed of the random generators.
        horizon: number of samples of free run that the loss looks ahead.
        epochs: number of passes over the training data.
        diverged: fold and repeat of the trainings whose loss was no longer finite.
        seconds: duration of the training, s.
        history: loss and identified parameters after every epoch: columns fold, repeat, epoch, loss, seconds,
            and one column in SI units for every identified parameter.
    """

    model: Nnap
    integration: Integration
    trained_on: Mapping[str, tuple[str, ...]]
    repeats: int
    seed: int
    horizon: int
    epochs: int
    diverged: tuple[tuple[str, int], ...]
    seconds: float
    history: pd.DataFrame

    @property
    def system(self) -> System:
        """Physics that the networks are added to."""
        return self.model.structure.system

    @property
    def folds(self) -> list[str]:
        """Names of the folds."""
        return list(self.trained_on)

    def seen(self, logs: Logs) -> dict[str, Mask]:
        """Return which experiments the models of every fold were trained on, by name of the fold.

        Args:
            logs: n experiments with the states of the system.

        Returns:
            Masks, shape (n,) each.

        Raises:
            BadInput: when the logs have other states than the system.
        """
        names = tuple(state.name for state in self.system.states)
        if logs.states != names:
            raise BadInput(f"logs: have the states {', '.join(logs.states)}, the fit {', '.join(names)}")
        return {fold: np.isin(logs.ids, ids) for fold, ids in self.trained_on.items()}

    def table(self) -> pd.DataFrame:
        """Return the identified parameters.

        Returns:
            One row per identified parameter: parameter, unit, known (value in the system file), and median,
            low and high (smallest and largest value) over all models.
        """
        structure, values = self.model.structure, self.model.physics().detach().numpy()
        rows = []
        for name, k in zip(structure.trainable, structure.index, strict=True):
            known, found = structure.system.parameters[k], pd.Series(values[:, k])
            spread = {"median": found.median(), "low": found.min(), "high": found.max()}
            rows.append({"parameter": name, "unit": known.unit, "known": known.value, **spread})
        return pd.DataFrame(rows, columns=["parameter", "unit", "known", "median", "low", "high"])

    def __str__(self) -> str:
        """Number of models, networks, and the identified parameters, one per line."""
        count = f"{self.model.batch} models of {self.system.name} ({len(self.folds)} folds)"
        networks = [f"{n.hidden} hidden units in {n.port}" for n in self.model.structure.networks]
        lines = [f"{count}: {', '.join(networks) or 'no networks'}"]
        for row in self.table().itertuples():
            found = f"{row.median:.4g} {row.unit}, from {row.low:.4g} to {row.high:.4g}"
            lines.append(f"{row.parameter}: {found} over {self.model.batch} models")
        lines += [f"fold {fold}, repeat {repeat}: diverged" for fold, repeat in self.diverged]
        return "\n".join(lines)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        first, *_ = str(self).splitlines()
        return shown(f"Fit of {self.system.name}", [first], {"Identified parameters": self.table()})

    def save(self, folder: Path | str) -> None:
        """Write the fit to a folder, from which `load` and the verb `evaluate` read it.

        Args:
            folder: folder of model.pt (weights), system.yaml (physics), history.parquet and fit.json (what
                was fitted, in numbers); new, empty or of an older fit, which is replaced as a whole.

        Raises:
            BadInput: when the folder holds what another verb or a user wrote, or a file cannot be written.
        """
        sources = {"system": self.system.source}
        with writing("train", Path(folder), sources), replacing_folder(Path(folder)) as new:
            self._write(new)

    def _write(self, folder: Path) -> None:
        write_system(self.system, folder / "system.yaml")
        save(self.model, folder / "model.pt", self._about())
        with replacing(folder / "history.parquet") as temporary:
            write_parquet(self.history, temporary)
        structure = self.model.structure
        size = {"parameters": structure.size + len(structure.trainable)}
        facts = {**self._numbers, **size, "identified": list(structure.trainable)}
        write_json(folder / "fit.json", facts)

    @property
    def _numbers(self) -> dict[str, Any]:
        """What both files say of the training."""
        numbers = {name: getattr(self, name) for name in NUMBERS}
        return {"folds": self.folds, **numbers, "diverged": [list(label) for label in self.diverged]}

    def _about(self) -> dict[str, Any]:
        structure = self.model.structure
        networks = [
            {
                **{"port": n.port, "hidden": n.hidden, "label": n.label},
                "inputs": texts_of(structure.system, n.inputs),
            }
            for n in structure.networks
        ]
        return {
            **self._numbers,
            "trained_on": {fold: list(ids) for fold, ids in self.trained_on.items()},
            "trainable": list(structure.trainable),
            "networks": networks,
            "integration": asdict(self.integration),
        }

    @classmethod
    def load(cls, folder: Path | str) -> Fit:
        """Read a fit that `save` or the verb `train` wrote.

        Args:
            folder: folder of the fit.

        Returns:
            Fit whose models predict as before.

        Raises:
            BadInput: when a file is missing or damaged.
        """
        folder = Path(folder)
        path, system = folder / "model.pt", read_system(folder / "system.yaml")
        about = read_checkpoint(path)["about"]
        check_shape(path, about, SHAPE)
        if foreign := sorted({*map(str, about["integration"])} - {*INTEGRATION}):
            raise BadInput(f"{path}: integration: has the unknown key {foreign[0]!r}: train again")
        networks = tuple(
            Network(n["port"], network_inputs(system, n["inputs"]), n["hidden"], n["label"])
            for n in about["networks"]
        )
        _check_names(system, networks, about["trainable"], path)
        model = load_stack(Augmented(system, networks, tuple(about["trainable"])), path)[0]
        if model.batch != len(about["trained_on"]) * about["repeats"]:
            raise BadInput(f"{path}: holds {model.batch} models, another number than it says")
        return cls(
            model=model,
            integration=Integration(**about["integration"]),
            trained_on={fold: tuple(ids) for fold, ids in about["trained_on"].items()},
            **{name: about[name] for name in NUMBERS},
            diverged=tuple((str(fold), int(repeat)) for fold, repeat in about["diverged"]),
            history=read_parquet(folder / "history.parquet"),
        )


def _check_names(system: System, networks: tuple[Network, ...], trainable: list[str], path: Path) -> None:
    known = {*system.port_names, *(p.name for p in system.parameters)}
    for name in (*(network.port for network in networks), *trainable):
        if name not in known:
            raise BadInput(f"{path}: names {name!r}, which {path.with_name('system.yaml')} does not have")


def load_stack(structure: Augmented, path: Path) -> tuple[Nnap, dict[str, Any]]:
    """Read a fitted stack of a known structure."""
    content = read_checkpoint(path)
    parts = ("p", "unit", "scale", "gain", "weights")
    try:
        model = Nnap(structure, *(content["state"][name] for name in parts))
    except (KeyError, TypeError, AttributeError, IndexError, RuntimeError):
        raise BadInput(
            f"{path}: is a checkpoint of {content['class']}, not of the configured model"
        ) from None
    restore(model, content, path)
    _check_shapes(model, path)
    return model, content["about"]


def _check_shapes(model: Nnap, path: Path) -> None:
    structure, batch = model.structure, model.batch
    wanted = {
        "p": (batch, len(structure.system.parameters)),
        "unit": (len(structure.trainable),),
        "scale": (batch, len(structure.inputs)),
        "gain": (batch, len(structure.networks)),
        "weights": (batch, structure.size),
    }
    for name, shape in wanted.items():
        found = tuple(getattr(model, name).shape)
        if found != shape:
            raise BadInput(f"{path}: does not fit the configured model ({name} must be {shape}, got {found})")
