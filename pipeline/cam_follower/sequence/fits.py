"""Store fitted networks in one small file each, so that an interrupted training loses at most one fit."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.cam_follower.detachment import Fitted
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.arrays import Array
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.base.threads import one_thread
from unmodelled.learning.checkpoint import read_checkpoint, restore, save

#: Written when all fits of a folder are there.
SUMMARY = "fits.json"


def path_of(folder: Path, fold: int, repeat: int) -> Path:
    """Return the path of the file of one fit."""
    return folder / f"{fold:02d}_{repeat:02d}.pt"


def save_fit(path: Path, network: DetachmentNetwork, about: Mapping[str, Any]) -> None:
    """Write a network and facts about it."""
    shape = {
        "features": list(network.inputs.features),
        "settings": list(network.inputs.settings),
        "hidden": network.lstm.hidden_size,
        "head": network.head.out_features,
        "dropout": float(network.dropout.p),
    }
    save(network, path, {**about, **shape})


def read_about(path: Path, inputs: SequenceInputs) -> dict[str, Any]:
    """Read the facts about a fit."""
    about: dict[str, Any] = _checked(path)["about"]
    for name, wanted in (("features", inputs.features), ("settings", inputs.settings)):
        if about[name] != list(wanted):
            found = ", ".join(map(str, about[name])) or "none"
            raise BadInput(f"{path}: was fitted on the {name} {found}, not on {', '.join(wanted) or 'none'}")
    return about


def read_fit(path: Path) -> tuple[DetachmentNetwork, dict[str, Any]]:
    """Read a network that `save_fit` wrote, and the facts about it."""
    content = _checked(path)
    about = content["about"]
    try:
        inputs = SequenceInputs(about["features"], about["settings"])
        network = DetachmentNetwork(inputs, about["hidden"], about["head"], about["dropout"])
    except (TypeError, ValueError, RuntimeError) as error:
        raise BadInput(f"{path}: not a checkpoint of a network ({str(error).splitlines()[0][:80]})") from None
    restore(network, content, path)
    return network.train(False), about


def _checked(path: Path) -> dict[str, Any]:
    content = read_checkpoint(path)
    if content["class"] != DetachmentNetwork.__name__:
        raise BadInput(
            f"{path}: is a checkpoint of {content['class']}, not of a {DetachmentNetwork.__name__}"
        )
    about = content["about"]
    texts, numbers = ("identity", "fold"), ("repeat", "updates", "samples", "hidden", "head")
    wanted = {**dict.fromkeys(texts, str), **dict.fromkeys(numbers, int), "converged": bool}
    wanted |= {"features": list, "settings": list, "dropout": float, "seconds": float}
    for name, kind in wanted.items():
        if not isinstance(about, dict) or not isinstance(about.get(name), kind):
            raise BadInput(f"{path}: does not say what was fitted ({name} is missing)")
    return content


@dataclass(frozen=True)
class Fits(Fitted):
    """All networks of a folder."""

    inputs: SequenceInputs
    samples: int  # number after which a run is cut off
    networks: Mapping[str, list[DetachmentNetwork]]  # by fold, one per repeat

    @property
    def folds(self) -> list[str]:
        return list(self.networks)

    @property
    def explainable(self) -> Mapping[str, list[DetachmentNetwork]]:
        return self.networks

    def sequences(self, campaign: Campaign) -> Sequences:
        """Return the runs of a campaign in the form that the networks read."""
        return Sequences.of(campaign, self.inputs, self.samples)

    def predict(self, fold: str, sequences: Sequences) -> Array:
        """Predict the detachment eps of runs by every repeat of a fold; gives (repeats, runs, steps) in m."""
        with one_thread():
            return np.stack([network.predict(sequences) for network in self.networks[fold]])

    def detachment(self, fold: str, campaign: Campaign) -> Array:
        return self.predict(fold, self.sequences(campaign))


def read_fits(folder: Path) -> Fits:
    """Read the networks that `SequenceRecipe.fit` wrote."""
    summary = read_json(folder / SUMMARY)
    try:
        names, repeats = [str(name) for name in summary["folds"]], range(int(summary["repeats"]))
    except (KeyError, TypeError, ValueError):
        raise BadInput(f"{folder / SUMMARY}: does not say which folds and repeats there are") from None
    networks = {
        name: [read_fit(path_of(folder, fold, repeat)) for repeat in repeats]
        for fold, name in enumerate(names)
    }
    if not networks or not repeats:
        raise BadInput(f"{folder / SUMMARY}: there are no fits")
    (first, about), *_ = next(iter(networks.values()))
    for fold, name in enumerate(names):
        for repeat, (_, other) in enumerate(networks[name]):
            if other["fold"] != name or any(
                other[key] != about[key] for key in ("features", "settings", "samples")
            ):
                raise BadInput(f"{path_of(folder, fold, repeat)}: is of another training than the other fits")
    kept = {name: [network for network, _ in fits] for name, fits in networks.items()}
    return Fits(first.inputs, about["samples"], kept)
