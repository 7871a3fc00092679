"""Kernel, training and fits of recurrent networks: as by torch, converged or not, read back and gone on."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import torch

from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequence import recipe as recipes
from pipeline.cam_follower.sequence.arrays import Sizes, room, views
from pipeline.cam_follower.sequence.fits import read_fits
from pipeline.cam_follower.sequence.kernel import gradient
from pipeline.cam_follower.sequence.layout import flattened, sizes
from pipeline.cam_follower.sequence.passes import load
from pipeline.cam_follower.sequence.recipe import SequenceRecipe
from pipeline.cam_follower.sequence.stack import train_stack
from pipeline.cam_follower.sequence.training import Course, Draws, Start, Training, standardised, train
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.arrays import Single
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput
from unmodelled.base.threads import one_thread

INPUTS = SequenceInputs(("sin(theta)", "cos(theta)", "omega", "F_dagger", "alpha"), ("m", "H", "beta"))
FEW = Training(batch=6, epochs=1, updates=1, most=6)


def made(runs: int = 11, seed: int = 0) -> Campaign:
    """Runs of 9 to 40 samples whose eps is what a leaky integrator makes of a negative force."""
    generator = np.random.default_rng(seed)
    lengths = generator.integers(9, 41, runs)
    parts = []
    for n in lengths:
        theta = np.cumsum(generator.uniform(0.1, 0.4, n))
        force = 3.0 + 8.0 * np.cos(theta + generator.uniform(0, 6)) + 0.3 * generator.standard_normal(n)
        eps = np.zeros(n)
        for k in range(1, n):
            eps[k] = 0.8 * eps[k - 1] + 1e-3 * max(0.0, -force[k])
        noise = generator.standard_normal((2, n))
        parts.append({"theta": theta, "omega": noise[0], "alpha": noise[1], "F_dagger": force, "eps": eps})
    signals = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    settings = {name: generator.random(runs) for name in ("m", "H", "beta")}
    table = pd.DataFrame({"exp": np.arange(runs) + 1, **settings})
    return Campaign(table, signals, np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64), {})


def beginning(seed: int = 0, inputs: SequenceInputs = INPUTS, dropout: float = 0.0, **shape: int) -> Start:
    """A network, scaled to `made()`, of the given sizes."""
    sequences = Sequences.of(made(), inputs)
    generator = torch.Generator().manual_seed(seed)
    network = DetachmentNetwork(inputs, dropout=dropout, generator=generator, **shape)
    network.scale_to(sequences)
    return Start(network, standardised(sequences, network), seed)


TRAINING = """
from hashlib import sha256
from pipeline.cam_follower.sequence.layout import flattened
from pipeline.cam_follower.sequence.training import Training, train
from tests.learning.test_sequence_training import beginning
start = beginning(dropout=0.05)
train(start, Training(batch=6, most=40))
print(sha256(flattened(start.network)).hexdigest())
"""


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    """Operations as small as these take longer in several."""
    with one_thread():
        yield


@pytest.mark.parametrize("shape", [{}, {"hidden": 20, "head": 8}])
@pytest.mark.parametrize("inputs", [INPUTS, SequenceInputs(("F_dagger",))])
def test_the_gradient_is_that_of_torch(shape: dict[str, int], inputs: SequenceInputs) -> None:
    """Against nn.LSTM in double precision, on all runs, of different length, at once."""
    start = beginning(inputs=inputs, **shape)
    network, runs, s = start.network, start.runs, sizes(start.network)
    loaded, work = room(runs.lengths, len(runs.lengths), s)
    batch = load(runs, np.argsort(-runs.lengths), loaded)
    slope = np.zeros(s.weights, np.float32)
    loss = gradient(flattened(network), batch, s, work, np.float32(0.0), 0, slope)

    network.double()
    tau = torch.from_numpy(runs.tau[..., : len(inputs.features)]).double()
    error = network.scaled(tau, torch.from_numpy(runs.q).double()) - torch.from_numpy(runs.target)
    mask = torch.arange(runs.tau.shape[1]) < torch.from_numpy(runs.lengths)[:, None]
    expected = error[mask].square().mean()
    expected.backward()  # type: ignore[no-untyped-call]
    assert float(loss) == pytest.approx(expected.item(), rel=1e-5)
    for name, parameter in network.named_parameters():
        assert parameter.grad is not None
        if name == "lstm.bias_hh_l0":  # the sum of both biases is one weight
            parameter.data.zero_()
        else:
            parameter.data.copy_(parameter.grad)
    wanted = views(flattened(network.float()), s)
    for found, exact in zip(views(slope, s), wanted, strict=True):
        np.testing.assert_allclose(found, exact, rtol=1e-4, atol=1e-4 * np.abs(exact).max(initial=0.0))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"dropout": 1.0}, "must be"),
        ({"dropout": -0.1}, "must be"),
        ({"samples": 0}, "must be"),
        ({"hidden": 30}, "hidden must be a multiple of 4, got 30"),  # the size of vectors
    ],
)
def test_impossible_settings_are_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        replace(RECIPE, **settings)


def trained(cache: Path) -> str:
    """A digest of the weights, trained by a process that keeps its compiled loops in `cache`."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", TRAINING]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout


@pytest.mark.long
def test_a_training_that_compiles_ends_at_the_same_weights(tmp_path: Path) -> None:
    first = trained(tmp_path)
    kept = list(tmp_path.rglob("passes.epoch*.nb?"))
    assert kept and trained(tmp_path) == first
    for path in kept:  # as a process that was killed while it compiled leaves it
        path.unlink()
    assert trained(tmp_path) == first


def test_kernel_and_torch_train_alike() -> None:
    """Same first weights and draws, no dropout: the same losses, as long as rounding has not grown."""
    training = Training(batch=6, epochs=2, updates=1, most=24, clip=0.5, falls=99)
    seeds = (0, 1, 2)
    compiled = [beginning(seed) for seed in seeds]
    courses = [train(start, training) for start in compiled]
    stacked = [beginning(seed) for seed in seeds]
    others = train_stack(stacked, training, "cpu")
    for one, other, course, expected in zip(compiled, stacked, courses, others, strict=True):
        assert course.updates == expected.updates == 24 and len(course.losses) == 6
        np.testing.assert_allclose(course.losses, expected.losses, rtol=1e-3)
        torch.testing.assert_close(one.network.state_dict(), other.network.state_dict(), rtol=0, atol=2e-3)
    assert len({course.losses[0] for course in courses}) == 3


def test_dropout_of_kernel_and_torch_costs_alike() -> None:
    standing = Training(batch=11, rate=0.0, epochs=60, updates=1, most=60)
    start = beginning()
    train(start, replace(standing, rate=0.01))
    without = train(start, standing).losses[0]
    start.network.dropout.p = 0.3
    one, other = train(start, standing).losses[0], train_stack([start], standing, "cpu")[0].losses[0]
    assert one > 1.5 * without
    assert one - without == pytest.approx(other - without, rel=0.1)


def test_training_converges_on_a_planted_relation() -> None:
    training = Training(batch=6, epochs=10, updates=40, falls=4, patience=1)
    start = beginning()
    course = train(start, training)
    assert course.converged and not course.diverged
    assert course.losses[-1] < 0.02 * course.losses[0]
    assert course.rates[0] == 0.01 and course.rates[-1] == 0.01 / 8
    sequences = Sequences.of(made(), INPUTS)
    error = (start.network.predict(sequences) - sequences.target)[sequences.mask]
    assert np.sqrt(np.mean(error**2)) < 0.15 * sequences.target[sequences.mask].std()


def test_the_rate_falls_where_the_loss_does_not() -> None:
    course = Course(Training(rate=1.0, epochs=2, updates=4, tolerance=0.1, patience=2, falls=2))
    rates = []
    #: mean of a check: 8, 4 (better), 3.9 and 3.8 (not by a tenth: fall), 1 (better), 0.95 and 2 (fall)
    for mean in (8.0, 4.0, 3.9, 3.8, 1.0, 0.95, 2.0):
        for _ in range(2):
            assert not course.over
            course.after_epoch(mean, 2)
        rates.append(course.rate)
    assert rates == [1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.25]
    assert course.rates == [1.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5]
    assert course.converged and course.over and course.updates == 28


def test_a_training_that_does_not_converge_ends_and_says_so() -> None:
    course = Course(replace(FEW, most=3))
    while not course.over:
        course.after_epoch(1.0 / (1 + course.updates), 1)
    assert course.updates == 3 and not course.converged


@pytest.mark.parametrize("compiled", [True, False])
def test_a_diverged_network_keeps_its_last_finite_weights(compiled: bool) -> None:
    start = beginning()
    start.runs.target[3, 0] = np.inf
    course = train(start, FEW) if compiled else train_stack([start], FEW, "cpu")[0]
    assert course.diverged and course.over and not course.converged
    torch.testing.assert_close(start.network.state_dict(), beginning().network.state_dict())


def test_every_run_is_drawn_once_an_epoch_longest_first() -> None:
    lengths = np.random.default_rng(0).integers(5, 40, 75)
    draws, same = Draws(lengths, 32, 7), Draws(lengths, 32, 7)
    assert draws.edges.tolist() == [0, 25, 50, 75]
    first, second = draws.epoch(), draws.epoch()
    for order in (first, second):
        assert sorted(order) == list(range(75))
        for a, b in zip(draws.edges, draws.edges[1:], strict=False):
            assert (np.diff(lengths[order[a:b]]) <= 0).all()
    assert set(first[:25]) != set(second[:25])
    np.testing.assert_array_equal(same.epoch(), first)


FOLDS = {"5%": np.array([0, 2, 4, 6, 8]), "H": np.array([1, 3, 5, 7, 9, 10])}
RECIPE = SequenceRecipe(INPUTS, FEW, hidden=8, head=8, samples=30)


def checkpoint(kind: str, about: dict[str, str]) -> dict[str, object]:
    return {"class": kind, "state": {}, "about": about}


def weights(folder: Path) -> dict[str, Single]:
    fits = read_fits(folder).networks
    return {f"{fold} {r}": flattened(n) for fold, networks in fits.items() for r, n in enumerate(networks)}


def test_fits_of_folds_and_repeats_are_read_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
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


def test_a_killed_training_ends_at_the_same_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
def test_fits_of_other_data_settings_or_seed_are_made_anew(change: str, out: Path) -> None:
    campaign, before = made(), weights(out)
    recipe = replace(RECIPE, training=replace(FEW, rate=0.02)) if change == "rate" else RECIPE
    if change == "data":
        # a sample of the second run, which only the fold H trains on
        campaign.signals["eps"][campaign.offsets[1] + 3] += 1e-3
    recipe.fit(campaign, FOLDS, 1, 6 if change == "seed" else 5, out)
    after = weights(out)
    assert np.array_equal(after["5% 0"], before["5% 0"]) == (change == "data")
    assert not np.array_equal(after["H 0"], before["H 0"])


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda path: path.write_bytes(b"PK nonsense"), "01_00.pt: not a checkpoint"),
        (lambda path: path.write_bytes(path.read_bytes()[:900]), "01_00.pt: not a checkpoint"),
        (lambda path: torch.save(checkpoint("Motor", {}), path), "01_00.pt: is a .* of Motor"),
        (
            lambda path: torch.save(checkpoint("DetachmentNetwork", {"fold": "H"}), path),
            "01_00.pt: does not say what was fitted",
        ),
    ],
)
def test_a_damaged_fit_is_refused_and_nothing_overwritten(damage: Any, message: str, out: Path) -> None:
    damage(out / "01_00.pt")
    before = {p.name: p.read_bytes() for p in out.iterdir()}
    for attempt in (lambda: RECIPE.fit(made(), FOLDS, 1, 6, out), lambda: read_fits(out)):
        with pytest.raises(BadInput, match=message):
            attempt()
        assert {p.name: p.read_bytes() for p in out.iterdir()} == before


@pytest.fixture
def out(tmp_path: Path) -> Path:
    RECIPE.fit(made(), FOLDS, 1, 5, tmp_path / "out")
    return tmp_path / "out"


def test_weights_of_another_shape_are_refused(out: Path) -> None:
    content = torch.load(out / "00_00.pt", weights_only=True)
    content["about"]["hidden"] = 12
    torch.save(content, out / "00_00.pt")
    with pytest.raises(BadInput, match=r"00_00.pt: does not fit the configured model"):
        read_fits(out)


def test_fits_of_other_features_are_refused(out: Path) -> None:
    words = r"00_00.pt: was fitted on the (features|settings) .*, not on (omega|none)"
    for other in (replace(INPUTS, settings=()), replace(INPUTS, features=("omega",))):
        with pytest.raises(BadInput, match=words):
            replace(RECIPE, inputs=other).fit(made(), FOLDS, 1, 5, out)
    assert len(read_fits(out).networks) == 2


@pytest.mark.parametrize("summary", [{}, {"folds": [], "repeats": 1}, {"folds": ["H"], "repeats": 1}])
def test_a_folder_of_something_else_is_refused(summary: dict[str, object], out: Path) -> None:
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
