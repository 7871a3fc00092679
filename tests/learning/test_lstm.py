"""Sequences are cut, padded and checked; the network is the one of the equations, causal and in SI units."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch

from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.arrays import Array
from unmodelled.base.campaign import Campaign
from unmodelled.base.errors import BadInput

INPUTS = SequenceInputs(("sin(theta)", "cos(theta)", "omega"), ("m", "H"))
LENGTHS = (5, 9, 3, 7)
Names = tuple[str, ...]


@pytest.fixture
def campaign() -> Campaign:
    generator, total = np.random.default_rng(1), sum(LENGTHS)
    signals = {name: generator.normal(2.0, 3.0, total) for name in ("theta", "omega")}
    signals["eps"] = 1e-3 * generator.random(total)
    table = pd.DataFrame({"exp": [11, 12, 13, 14], "m": [0.7, 0.9, 1.1, 1.3], "H": 0.03, "label": "jump"})
    return Campaign(table, signals, np.concatenate([[0], np.cumsum(LENGTHS)]), {})


def fitted_scales(sequences: Sequences, **shape: int) -> DetachmentNetwork:
    network = DetachmentNetwork(sequences.inputs, generator=torch.Generator().manual_seed(0), **shape)
    network.scale_to(sequences)
    return network.double()


def test_runs_are_cut_and_padded(campaign: Campaign) -> None:
    sequences = Sequences.of(campaign, INPUTS, most=7)
    assert sequences.features.shape == (4, 7, 3)
    assert sequences.mask.sum(1).tolist() == [5, 7, 3, 7]
    assert (sequences.features[~sequences.mask] == 0.0).all()
    assert (sequences.target[~sequences.mask] == 0.0).all()
    theta, second = campaign.signals["theta"], slice(5, 12)
    np.testing.assert_allclose(sequences.features[1, :, 0], np.sin(theta[second]))
    np.testing.assert_allclose(sequences.features[1, :, 1], np.cos(theta[second]))
    np.testing.assert_array_equal(sequences.features[1, :, 2], campaign.signals["omega"][second])
    np.testing.assert_array_equal(sequences.target[1], campaign.signals["eps"][second])
    np.testing.assert_array_equal(sequences.settings[:, 0], campaign.experiments["m"])
    some = sequences.of_runs(np.array([2, 0]))
    assert some.runs.tolist() == [13, 11] and some.features.shape == (2, 5, 3)
    np.testing.assert_array_equal(some.features[1], sequences.features[0, :5])
    assert Sequences.of(campaign, INPUTS).features.shape == (4, 9, 3)


@pytest.mark.parametrize(
    ("features", "settings", "message"),
    [
        (("omega", "speed"), (), "feature speed: the campaign has no such signal"),
        (("omega",), ("mass",), "setting mass: the campaign has no such column"),
        (("omega",), ("label",), "setting label: is not a column of numbers"),
        ((), (), "features: "),
        (("omega", "omega"), (), "features: "),
    ],
)
def test_wrong_inputs_are_named(campaign: Campaign, features: Names, settings: Names, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        Sequences.of(campaign, SequenceInputs(features, settings))


@pytest.fixture
def sequences(campaign: Campaign) -> Sequences:
    return Sequences.of(campaign, INPUTS)


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["omega", "eps", "theta"])
def test_a_gap_is_named_with_its_run_and_feature(campaign: Campaign, name: str, value: float) -> None:
    campaign.signals[name][5 + 3] = value
    feature = r"sin\(theta\)" if name == "theta" else name
    words = f"experiment 12: feature {feature} is not a finite number at sample 3"
    with pytest.raises(BadInput, match=words):
        Sequences.of(campaign, INPUTS)
    # behind the cut nobody looks
    assert len(Sequences.of(campaign, INPUTS, most=3)) == 4


def test_a_gap_in_a_setting_is_named(campaign: Campaign) -> None:
    campaign.experiments.loc[2, "m"] = np.nan
    with pytest.raises(BadInput, match="experiment 13: setting m is not a finite number"):
        Sequences.of(campaign, INPUTS)


def test_a_run_without_samples_is_named(campaign: Campaign) -> None:
    offsets = campaign.offsets.copy()
    offsets[2] = offsets[1]
    with pytest.raises(BadInput, match="experiment 12: has no samples"):
        Sequences.of(replace(campaign, offsets=offsets), INPUTS)


def by_hand(network: DetachmentNetwork, tau: Array, q: Array) -> list[float]:
    """Equations 5.8 to 5.12 for one run in standardised units."""
    w = {name: value.detach().numpy() for name, value in network.named_parameters()}

    def sigmoid(x: Array) -> Array:
        return 1.0 / (1.0 + np.exp(-x))

    s = c = np.zeros(network.lstm.hidden_size)
    found = []
    for sample in tau:
        gates = w["lstm.weight_ih_l0"] @ sample + w["lstm.weight_hh_l0"] @ s + w["lstm.bias_ih_l0"]
        i, f, g, o = np.split(gates + w["lstm.bias_hh_l0"], 4)
        c = sigmoid(f) * c + sigmoid(i) * np.tanh(g)
        s = sigmoid(o) * np.tanh(c)
        units = np.maximum(0.0, w["head.weight"] @ np.concatenate([s, q]) + w["head.bias"])
        found.append(float(w["output.weight"][0] @ units + w["output.bias"][0]))
    return found


def test_the_network_is_the_one_of_the_equations(sequences: Sequences) -> None:
    network = fitted_scales(sequences, hidden=5, head=6)
    real, run = sequences.mask, 1
    tau = (sequences.features[run] - sequences.features[real].mean(0)) / sequences.features[real].std(0)
    m = sequences.settings[:, 0]
    # H is the same in all runs: it must not blow up
    q = np.array([(m[run] - m.mean()) / m.std(), 0.0])
    expected = np.array(by_hand(network, tau, q)) * sequences.target[real].std()
    np.testing.assert_allclose(network.predict(sequences)[run], expected, rtol=1e-6)


def test_a_run_is_predicted_alike_alone_and_among_others_and_knows_no_future(campaign: Campaign) -> None:
    sequences = Sequences.of(campaign, INPUTS)
    network = fitted_scales(sequences)
    together = network.predict(sequences)
    assert (together[~sequences.mask] == 0.0).all() and (together[sequences.mask] != 0.0).all()
    alone = network.predict(sequences.of_runs(np.array([2])))[0]
    np.testing.assert_allclose(alone, together[2, :3], rtol=1e-10)
    past = network.predict(Sequences.of(campaign, INPUTS, most=4))[1]
    np.testing.assert_allclose(past, together[1, :4], rtol=1e-10)


def test_prediction_is_without_dropout_and_leaves_the_mode_alone(sequences: Sequences) -> None:
    network = fitted_scales(sequences).train()
    np.testing.assert_array_equal(network.predict(sequences), network.predict(sequences))
    assert network.training
    tau, q = torch.from_numpy(sequences.features), torch.from_numpy(sequences.settings)
    assert not torch.equal(network(tau, q), network(tau, q))


def test_other_inputs_are_refused(campaign: Campaign) -> None:
    network = fitted_scales(Sequences.of(campaign, INPUTS))
    other = Sequences.of(campaign, SequenceInputs(("omega",)))
    words = r"reads features sin.* settings m, H, got features omega and settings none"
    with pytest.raises(BadInput, match=words):
        network.predict(other)


def test_first_weights_follow_the_seed_and_remember() -> None:
    generators = (torch.Generator().manual_seed(seed) for seed in (3, 3, 4))
    one, same, other = (DetachmentNetwork(INPUTS, generator=each) for each in generators)
    assert all(torch.equal(a, b) for a, b in zip(one.parameters(), same.parameters(), strict=True))
    assert not torch.equal(one.lstm.weight_hh_l0, other.lstm.weight_hh_l0)
    bias = (one.lstm.bias_ih_l0 + one.lstm.bias_hh_l0).detach().reshape(4, -1)
    assert bias.mean(1).tolist() == [0.0, 1.0, 0.0, 0.0]
    gate = one.lstm.weight_hh_l0.detach()[32:64]
    torch.testing.assert_close(gate @ gate.T, torch.eye(32), atol=1e-5, rtol=0.0)
