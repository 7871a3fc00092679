"""DeepSHAP through the LSTM: DeepLIFT attributions, averaged over the background (section 5.5.1).

`shap.DeepExplainer` does not support LSTMs. Phi_{i,k} is a sum over all steps j <= k (eq. 5.22). Therefore
the contributions of all features to the states are propagated forward in time, which gives Phi at every step
k in one sweep; backward propagation needs one sweep per step k. Both are the same product of matrices,
multiplied from either end.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from pipeline.attribution.background import check_inputs, shares_of_references
from pipeline.attribution.recurrent import Recurrent, Trace
from pipeline.attribution.result import Attribution
from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import Sequences
from unmodelled.base.threads import one_thread

#: References whose contributions are carried together; many more do not fit a processor's cache.
PART = 32


@one_thread()
def deep_shap(network: DetachmentNetwork, runs: Sequences, background: Sequences) -> list[Attribution]:
    """Attribute the output of every run and step to its inputs, relative to the background's mean.

    At step k the background is B_k of `shares_of_references`. The computing time grows with runs x steps x
    references x features.
    """
    recurrent = Recurrent.of(network)
    check_inputs(recurrent.inputs, runs, background)
    longest = int(runs.lengths.max())
    shares = shares_of_references(background, longest)
    explained = [recurrent.trace(runs.of_runs(np.array([i])), int(n)) for i, n in enumerate(runs.lengths)]
    phi = [x.output.new_zeros((len(x.output), x.tau.shape[2] + x.q.shape[1])) for x in explained]
    base = torch.zeros(longest, dtype=torch.float64)
    for rows in torch.split(torch.arange(len(background)), PART):
        references = recurrent.trace(background.of_runs(rows.numpy()), longest)
        base += (shares[:, rows] * references.output).sum(1)
        for x, total in zip(explained, phi, strict=True):
            r = references.until(len(total))
            total += torch.einsum("kr,kri->ki", shares[: len(total), rows], contributions(recurrent, x, r))
    names = (*runs.inputs.features, *runs.inputs.settings)
    return [
        Attribution(int(run), names, total.T.numpy(), base[: len(total)].numpy(), x.output[:, 0].numpy())
        for run, total, x in zip(runs.runs, phi, explained, strict=True)
    ]


def contributions(network: Recurrent, x: Trace, r: Trace) -> Tensor:
    """Return contributions Phi_{i,k} relative to each reference, (steps, references, n_tau + n_q), m."""
    m = multipliers(network, x, r)
    to_state = _to_states(network, m, x.tau - r.tau)
    of_features = (to_state * m.state[:, :, None]).sum(-1)
    return torch.cat([of_features, m.settings * (x.q - r.q)], -1)


def _to_states(network: Recurrent, m: "Multipliers", difference: Tensor) -> Tensor:
    """Return the contributions of `difference` (steps, references, n_tau) to s, one more axis n_s."""
    steps, references, features = difference.shape
    n = network.size
    s = difference.new_zeros((steps, references * features, n))
    c = difference.new_zeros((references, features, n))
    z = difference.new_empty((references, features, 4 * n))
    for k in range(steps):
        torch.mul(difference[k][..., None], network.W_tau, out=z)
        if k:
            z.view(-1, 4 * n).addmm_(s[k - 1], network.W_s)
        z *= m.gates[k][:, None]
        i, f, o, g = torch.split(z, n, -1)
        c.mul_(m.keep[k][:, None]).add_(i).add_(f).add_(g)
        torch.addcmul(o, c, m.show[k][:, None], out=s[k].view_as(c))
    return s.view(steps, references, features, n)


@dataclass(frozen=True)
class Multipliers:
    """Weights of the linearised network per step and reference.

    dz = (i, f, o, g) is the difference of the inputs of the gates; gates * dz has the parts i, f, o and g.
    Then dc_k = keep * dc_{k-1} + i + f + g, ds_k = show * dc_k + o, and d output = state . ds_k + settings .
    dq.
    """

    gates: Tensor  # (steps, references, 4 n_s), weights of the inputs of the gates
    keep: Tensor  # (steps, references, n_s), weights of the last cell state in the new cell state
    show: Tensor  # (steps, references, n_s), weights of the cell state in the hidden state
    state: Tensor  # (steps, references, n_s), weights of the hidden state in the output, m
    #: (steps, references, n_q), weights of the settings in the output, m per unit of the setting
    settings: Tensor


def multipliers(network: Recurrent, x: Trace, r: Trace) -> Multipliers:
    """Linearise the network between a run and references."""
    n = network.size
    i, f, o, g = torch.split(0.5 * (x.a + r.a), n, -1)
    c = 0.5 * (x.c + r.c)[:-1]
    tanh_x, tanh_r = x.c[1:].tanh(), r.c[1:].tanh()
    partner = torch.cat([g, c, 0.5 * (tanh_x + tanh_r), i], -1)
    head = network.W6 * _relu(x.hidden, r.hidden)
    return Multipliers(
        _gates(x, r, 3 * n) * partner,
        f,
        o * _tanh(tanh_x, tanh_r, (x.c - r.c)[1:]),
        head @ network.W5_s.T,
        head @ network.W5_q.T,
    )


def _gates(x: Trace, r: Trace, first: int) -> Tensor:
    """Difference quotients of the gates; the `first` ones are sigmoids, the others hyperbolic tangents."""
    dz = x.z - r.z
    sigmoid = _sigmoid(x.a[..., :first], r.a[..., :first], dz[..., :first])
    return torch.cat([sigmoid, _tanh(x.a[..., first:], r.a[..., first:], dz[..., first:])], -1)


def _sigmoid(a: Tensor, b: Tensor, dz: Tensor) -> Tensor:
    """(a - b) / dz of two sigmoids, its slope at dz = 0, by an identity in which nothing cancels."""
    return 0.5 * (a * (1 - b) + b * (1 - a)) * _tanh_over(0.5 * dz)


def _tanh(a: Tensor, b: Tensor, dz: Tensor) -> Tensor:
    """(a - b) / dz of two hyperbolic tangents: tanh x - tanh y = (1 - tanh x tanh y) tanh(x - y)."""
    return (1 - a * b) * _tanh_over(dz)


def _tanh_over(x: Tensor) -> Tensor:
    return torch.where(x == 0, 1.0, x.tanh() / x)


def _relu(x: Tensor, r: Tensor) -> Tensor:
    """Difference quotient of the ReLU; its slope where x and r are equal."""
    return torch.where(x == r, (x > 0).double(), (x.relu() - r.relu()) / (x - r))
