"""Recurrent networks on disk: read back, gone on with after a kill, and refused where they do not fit."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequence import recipe as recipes
from pipeline.cam_follower.sequence.arrays import Sizes
from pipeline.cam_follower.sequence.fits import read_fits
from pipeline.cam_follower.sequence.layout import flattened
from pipeline.cam_follower.sequence.recipe import SequenceRecipe
from pipeline.cam_follower.sequences import SequenceInputs
from tests.learning.recurrent import FEW, INPUTS, made
from unmodelled.base.errors import BadInput
from unmodelled.base.threads import one_thread

FOLDS = {"5%": np.array([0, 2, 4, 6, 8]), "H": np.array([1, 3, 5, 7, 9, 10])}
RECIPE = SequenceRecipe(INPUTS, FEW, hidden=8, head=8, samples=30)


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Operations as small as these take longer in several."""
    with one_thread():
        yield


def weights(folder: Path) -> dict[str, NDArray[np.float32]]:
    fits = read_fits(folder).networks
    return {f"{fold} {r}": flattened(n) for fold, networks in fits.items() for r, n in enumerate(networks)}


def test_fits_of_all_folds_and_repeats_are_read_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    campaign = made()
    RECIPE.fit(campaign, FOLDS, 2, 5, tmp_path / "out")
    assert "4 of 4 fits have not converged, fold 5%, repeat 0 after 6 updates" in capsys.readouterr().err
    found = weights(tmp_path / "out")
    assert list(found) == ["5% 0", "5% 1", "H 0", "H 1"]
    assert not any(np.array_equal(found["5% 0"], found[name]) for name in ("5% 1", "H 0"))
    # neither the number of workers nor the other folds matter
    RECIPE.fit(campaign, {"H": FOLDS["H"]}, 2, 5, tmp_path / "alone", workers=1)
    np.testing.assert_array_equal(weights(tmp_path / "alone")["H 1"], found["H 1"])
    fits = read_fits(tmp_path / "out")
    sequences = fits.sequences(campaign)
    assert fits.inputs == INPUTS and sequences.features.shape[1] == 30
    both = fits.predict("H", sequences)
    assert both.shape == (2, 11, 30)
    np.testing.assert_array_equal(both[1], fits.networks["H"][1].predict(sequences))
    # standardised by the training runs alone
    train_runs = sequences.of_runs(FOLDS["5%"])
    mean = train_runs.features[train_runs.mask].mean(0)
    np.testing.assert_allclose(fits.networks["5%"][0].feature_mean, mean, rtol=1e-5)


def test_a_killed_training_goes_on_to_the_same_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign, whole, part = made(), tmp_path / "whole", tmp_path / "part"
    RECIPE.fit(campaign, FOLDS, 2, 5, whole)
    save, saved, dead = recipes.save_fit, [], []

    def killed(path: Path, *rest: Any) -> None:
        saved.append(path.name)
        if dead or len(saved) == 3:
            dead.append(path)
            raise KeyboardInterrupt
        save(path, *rest)

    monkeypatch.setattr(recipes, "save_fit", killed)
    with pytest.raises(KeyboardInterrupt):
        RECIPE.fit(campaign, FOLDS, 2, 5, part, workers=1)
    assert sorted(p.name for p in part.iterdir()) == ["00_00.pt", "00_01.pt"]
    with pytest.raises(BadInput, match=r"fits\.json: no such file"):
        read_fits(part)
    saved[:] = ["", "", ""]
    dead.clear()
    RECIPE.fit(campaign, FOLDS, 2, 5, part)
    assert sorted(saved[3:]) == ["01_00.pt", "01_01.pt"]
    for name, p in weights(whole).items():
        np.testing.assert_array_equal(weights(part)[name], p)


@pytest.mark.parametrize("change", ["seed", "rate", "data"])
def test_fits_of_other_data_settings_or_seed_are_made_anew(change: str, tmp_path: Path) -> None:
    campaign, out = made(), tmp_path / "out"
    RECIPE.fit(campaign, FOLDS, 1, 5, out)
    before = weights(out)
    recipe, seed = RECIPE, 5
    if change == "seed":
        seed = 6
    elif change == "rate":
        recipe = replace(RECIPE, training=replace(FEW, rate=0.02))
    else:
        # a sample of the second run, which only the fold H trains on
        campaign.signals["eps"][campaign.offsets[1] + 3] += 1e-3
    recipe.fit(campaign, FOLDS, 1, seed, out)
    after = weights(out)
    assert np.array_equal(after["5% 0"], before["5% 0"]) == (change == "data")
    assert not np.array_equal(after["H 0"], before["H 0"])


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda path: path.write_bytes(b"PK nonsense"), "01_00.pt: not a checkpoint"),
        (lambda path: path.write_bytes(path.read_bytes()[:900]), "01_00.pt: not a checkpoint"),
        (
            lambda path: torch.save({"class": "Motor", "state": {}, "about": {}}, path),
            "01_00.pt: is a .* of Motor",
        ),
        (
            lambda path: torch.save(
                {"class": "DetachmentNetwork", "state": {}, "about": {"fold": "H"}}, path
            ),
            "01_00.pt: does not say what was fitted",
        ),
    ],
)
def test_a_damaged_fit_is_refused_and_nothing_overwritten(damage: Any, message: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    RECIPE.fit(made(), FOLDS, 1, 5, out)
    damage(out / "01_00.pt")
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    for attempt in (lambda: RECIPE.fit(made(), FOLDS, 1, 6, out), lambda: read_fits(out)):
        with pytest.raises(BadInput, match=message):
            attempt()
        assert {p.name: p.read_bytes() for p in out.iterdir()} == before


def test_weights_of_another_shape_are_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    RECIPE.fit(made(), FOLDS, 1, 5, out)
    content = torch.load(out / "00_00.pt", weights_only=True)
    content["about"]["hidden"] = 12
    torch.save(content, out / "00_00.pt")
    with pytest.raises(BadInput, match=r"00_00.pt: does not fit the configured model"):
        read_fits(out)


def test_fits_of_other_features_are_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    RECIPE.fit(made(), FOLDS, 1, 5, out)
    for other in (replace(INPUTS, settings=()), replace(INPUTS, features=("omega",))):
        with pytest.raises(
            BadInput, match=r"00_00.pt: was fitted on the (features|settings) .*, not on (omega|none)"
        ):
            replace(RECIPE, inputs=other).fit(made(), FOLDS, 1, 5, out)
    assert len(read_fits(out).networks) == 2


@pytest.mark.parametrize("summary", [{}, {"folds": [], "repeats": 1}, {"folds": ["H"], "repeats": 1}])
def test_a_folder_of_something_else_is_refused(summary: dict[str, object], tmp_path: Path) -> None:
    out = tmp_path / "out"
    RECIPE.fit(made(), FOLDS, 1, 5, out)
    (out / "fits.json").write_text(json.dumps(summary))
    with pytest.raises(BadInput, match=r"does not say|there are no fits|of another training"):
        read_fits(out)


def test_another_device_trains_the_repeats_as_a_stack(tmp_path: Path) -> None:
    recipe = replace(RECIPE, dropout=0.0)
    recipe.fit(made(), FOLDS, 2, 5, tmp_path / "kernel")
    recipe.fit(made(), FOLDS, 2, 5, tmp_path / "torch", device="cpu:0")
    others = weights(tmp_path / "torch")
    for name, p in weights(tmp_path / "kernel").items():
        np.testing.assert_allclose(others[name], p, atol=1e-3)


def test_a_device_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="device nonsense: cannot be used"):
        RECIPE.fit(made(), FOLDS, 1, 5, tmp_path / "out", device="nonsense")
    assert Sizes(4, 8, 8, 0).weights == len(flattened(DetachmentNetwork(SequenceInputs(("omega",)), 8, 8)))
