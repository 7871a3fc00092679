"""Exact Shapley values of whole signals and settings (eq. 5.20), by enumeration of all coalitions.

A player is a signal over all time, a setting, or a group of these. An absent player has the values of a
reference, and the value of a coalition is the mean over the background. This is the interventional form of
eq. 5.21, which DeepSHAP approximates.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
import torch
from torch import Tensor

from pipeline.attribution.background import check_inputs, shares_of_references
from pipeline.attribution.recurrent import Recurrent, Trace
from pipeline.attribution.result import Attribution, positions
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.errors import BadInput
from unmodelled.base.threads import one_thread

#: 2^13 coalitions is where the time, which doubles with every player, becomes minutes per run.
MOST_PLAYERS = 13
#: Sequences that go through the LSTM together; many more do not fit a processor's cache.
ROWS = 1024


@one_thread()
def exact_shapley(
    network: DetachmentNetwork,
    runs: Sequences,
    background: Sequences,
    groups: Mapping[str, Sequence[str]] | None = None,
) -> list[Attribution]:
    """Return Shapley values of every run and step, relative to the background B_k of `shares_of_references`.

    Settings enter after the LSTM, so that the LSTM is evaluated once per coalition of signals. The computing
    time grows with runs x steps x references x coalitions.
    """
    recurrent = Recurrent.of(network)
    check_inputs(recurrent.inputs, runs, background)
    players = _Players.of(recurrent.inputs, groups)
    longest = int(runs.lengths.max())
    shares = shares_of_references(background, longest)
    references = recurrent.trace(background, longest)
    attributions = []
    for i, run in enumerate(runs.runs):
        x = recurrent.trace(runs.of_runs(np.array([i])), int(runs.lengths[i]))
        steps = len(x.output)
        value = _values(recurrent, x, references.until(steps), shares[:steps], players)
        phi = (shapley_weights(len(players.names)) @ value).numpy()
        base, output = value[0].numpy(), x.output[:, 0].numpy()
        attributions.append(Attribution(int(run), players.names, phi, base, output))
    return attributions


def shapley_weights(players: int) -> Tensor:
    """Return the weight (players, 2^players) of every coalition's value in the Shapley value of each player.

    Player i is in coalition S if bit i of S is set.
    """
    member = _coalitions(players)
    size = member.sum(1)
    weight = torch.tensor([1 / (players * comb(players - 1, k)) for k in range(players)], dtype=torch.float64)
    joining, without = weight[(size - 1).clamp(min=0)], weight[size.clamp(max=players - 1)]
    return torch.where(member.T, joining, -without)


@dataclass(frozen=True)
class _Players:
    """Players of the game: signals first, then settings."""

    names: tuple[str, ...]
    signals: Tensor  # (players of signals, n_tau), whether a feature belongs to a player
    settings: Tensor  # (players of settings, n_q), whether a setting belongs to a player

    @classmethod
    def of(cls, inputs: SequenceInputs, groups: Mapping[str, Sequence[str]] | None) -> "_Players":
        names = (*inputs.features, *inputs.settings)
        found = positions(names, groups if groups is not None else {name: (name,) for name in names})
        if len(found) > MOST_PLAYERS:
            raise BadInput(f"groups: exact Shapley values take at most {MOST_PLAYERS}, got {len(found)}")
        n_tau = len(inputs.features)
        for name, members in found.items():
            if min(members) < n_tau <= max(members):
                raise BadInput(f"groups: {name} holds both features and settings")
        belongs = torch.zeros((len(found), len(names)), dtype=torch.bool)
        for row, members in zip(belongs, found.values(), strict=True):
            row[members] = True
        first = belongs[:, :n_tau].any(1)
        ordered = sorted(found, key=lambda name: min(found[name]) >= n_tau)
        return cls(tuple(ordered), belongs[first, :n_tau], belongs[~first, n_tau:])


def _coalitions(players: int) -> Tensor:
    """(2^players, players) who is in each coalition."""
    return (torch.arange(2**players)[:, None] >> torch.arange(players) & 1).bool()


def _present(belongs: Tensor) -> Tensor:
    """(coalitions, inputs) what is present, from what belongs to each player (players, inputs)."""
    return (_coalitions(len(belongs)).double() @ belongs.double()).bool()


def _values(network: Recurrent, x: Trace, r: Trace, shares: Tensor, players: _Players) -> Tensor:
    """(coalitions, steps) mean output over the references, coalitions numbered as in `shapley_weights`."""
    signals, settings = _present(players.signals), _present(players.settings)
    entering = network.settings(torch.where(settings[:, None], x.q, r.q))
    value = x.output.new_empty((len(settings), len(signals), len(x.tau)))
    for rows in torch.split(torch.arange(len(signals)), max(1, ROWS // len(r.q))):
        s = c = x.output.new_zeros((len(rows) * len(r.q), network.size))
        present = signals[rows, None]
        for k, (now, then) in enumerate(zip(x.tau, r.tau, strict=True)):
            tau = torch.where(present, now, then)
            _, _, c, s = network.step(tau.flatten(0, 1), s, c)
            hidden = (s @ network.W5_s).view(len(rows), len(r.q), -1) + entering[:, None]
            value[:, rows, k] = network.output(hidden) @ shares[k]
    return value.flatten(0, 1)
