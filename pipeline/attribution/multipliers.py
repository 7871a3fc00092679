"""DeepLIFT multipliers of the detachment network (eq. 5.15 and 5.16).

Between a run and a reference the network is replaced by a linear one that maps the difference of their inputs
to that of their outputs exactly: an activation by its difference quotient (rescale rule), a product by its
fair split, in which each factor's difference counts with the mean of the other's two values (the Shapley
value of a game of two players).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from pipeline.attribution.recurrent import Recurrent, Trace


@dataclass(frozen=True)
class Multipliers:
    """The linear network, its weights per step and reference: (steps, references, ...).

    With dz = (i, f, o, g) the differences of what enters the gates, and the parts of gates * dz likewise,
    dc_k = keep * dc_{k-1} + i + f + g, ds_k = show * dc_k + o, d output = state . ds_k + settings . dq.

    Attributes:
        gates: (..., 4 n_s). keep, show: (..., n_s). state: (..., n_s). settings: (..., n_q).
    """

    gates: Tensor
    keep: Tensor
    show: Tensor
    state: Tensor
    settings: Tensor


def multipliers(network: Recurrent, x: Trace, r: Trace) -> Multipliers:
    """Multipliers between a run `x` (one run in its trace) and references `r`, of as many steps."""
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
