"""The detachment network as matrices in double precision, with its states step by step."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.errors import BadInput


@dataclass(frozen=True)
class Trace:
    """Intermediate results of the network along runs; the first axis is time."""

    tau: Tensor  # (steps, runs, n_tau), features in SI units
    q: Tensor  # (runs, n_q), settings in SI units
    z: Tensor  # (steps, runs, 4 n_s), inputs of the gates, in the order input, forget, output, candidate
    a: Tensor  # (steps, runs, 4 n_s), outputs of the gates, in the same order
    c: Tensor  # (steps + 1, runs, n_s), cell states, starting with c_0 = 0
    s: Tensor  # (steps, runs, n_s), hidden states, starting with s_1
    hidden: Tensor  # (steps, runs, n_eta), inputs of the ReLU units
    output: Tensor  # (steps, runs), detachment eps, m

    def until(self, steps: int) -> "Trace":
        """Return the first steps."""
        timed = {name: getattr(self, name)[:steps] for name in ("tau", "z", "a", "s", "hidden", "output")}
        return replace(self, c=self.c[: steps + 1], **timed)


@dataclass(frozen=True)
class Recurrent:
    """Network R of eq. 5.7 as matrices in double precision, inputs and output in SI units, without dropout.

    The first layers contain the standardisation of the inputs, the last one the scale of the output. Both are
    linear, so that attributions do not change.
    """

    inputs: SequenceInputs
    #: (n_tau, 4 n_s), weights of the features in the gates of eq. 5.8 to 5.11, ordered as in `Trace`
    W_tau: Tensor
    W_s: Tensor  # (n_s, 4 n_s), weights of the hidden state in the gates
    b: Tensor  # (4 n_s,), biases of the gates
    W5_s: Tensor  # (n_s, n_eta), weights of the hidden state in the head of eq. 5.12
    W5_q: Tensor  # (n_q, n_eta), weights of the settings in the head
    b5: Tensor  # (n_eta,), biases of the head
    W6: Tensor  # (n_eta,), weights of the ReLU units in the output, m
    b6: Tensor  # bias of the output, m, scalar

    @classmethod
    def of(cls, network: DetachmentNetwork) -> "Recurrent":
        """Convert a network, on the CPU."""
        weights = {name: value.double().cpu() for name, value in network.state_dict().items()}
        n_s, scale = network.lstm.hidden_size, weights["target_scale"]
        # torch keeps the candidate before the output gate
        order = torch.arange(4 * n_s).view(4, n_s)[[0, 1, 3, 2]].flatten()
        W_tau = weights["lstm.weight_ih_l0"][order] / weights["feature_scale"]
        W5_s, W5_q = torch.split(weights["head.weight"], [n_s, len(network.inputs.settings)], 1)
        W5_q = W5_q / weights["setting_scale"]
        b = weights["lstm.bias_ih_l0"] + weights["lstm.bias_hh_l0"]
        return cls(
            network.inputs,
            W_tau.T.contiguous(),
            weights["lstm.weight_hh_l0"][order].T.contiguous(),
            b[order] - W_tau @ weights["feature_mean"],
            W5_s.T.contiguous(),
            W5_q.T.contiguous(),
            weights["head.bias"] - W5_q @ weights["setting_mean"],
            weights["output.weight"][0] * scale,
            weights["output.bias"][0] * scale,
        )

    @property
    def size(self) -> int:
        """Size n_s of the state."""
        return len(self.W_s)

    def step(self, tau: Tensor, s: Tensor, c: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Advance tau (runs, n_tau), s, c (runs, n_s) by a step; gives z (runs, 4 n_s) and c (runs, n_s)."""
        z = torch.addmm(self.b, tau, self.W_tau).addmm_(s, self.W_s)
        gates, candidate = torch.split(z, [3 * self.size, self.size], 1)
        a = torch.cat([gates.sigmoid(), candidate.tanh()], 1)
        i, f, o, g = torch.split(a, self.size, 1)
        c = torch.addcmul(i * g, f, c)
        return z, a, c, o * c.tanh()

    def trace(self, runs: Sequences, steps: int) -> Trace:
        """Evaluate the network along the first steps of all runs, also beyond the end of shorter runs."""
        tau = torch.zeros((steps, len(runs), len(self.inputs.features)), dtype=torch.float64)
        known = torch.from_numpy(runs.features[:, :steps])
        tau[: known.shape[1]] = known.transpose(0, 1)
        q = torch.from_numpy(runs.settings)
        s = tau.new_zeros((len(runs), self.size))
        c, parts = s, []
        for now in tau:
            z, a, c, s = self.step(now, s, c)
            parts.append((z, a, c, s))
        z, a, c, s = (torch.stack(part) for part in zip(*parts, strict=True))
        hidden = s @ self.W5_s + self.settings(q)
        output = self.output(hidden)
        check_output(output, runs)
        return Trace(tau, q, z, a, torch.cat([torch.zeros_like(c[:1]), c]), s, hidden, output)

    def settings(self, q: Tensor) -> Tensor:
        """Return what settings (..., n_q) give the ReLU units (..., n_eta), including the bias."""
        return q @ self.W5_q + self.b5

    def output(self, hidden: Tensor) -> Tensor:
        """Return the detachment eps (...,), m, for given inputs (..., n_eta) of the ReLU units."""
        return hidden.relu() @ self.W6 + self.b6


def check_output(output: Tensor, runs: Sequences) -> None:
    """Refuse an output that is not finite before the end of a run. Takes output (steps, runs)."""
    ended = np.arange(1, len(output) + 1)[:, None] > runs.lengths
    wrong = np.argwhere(~(output.isfinite().numpy() | ended).T)
    if len(wrong):
        run, step = wrong[0]
        raise BadInput(
            f"experiment {runs.runs[run]}: the network's output is not a finite number at step {step + 1}"
        )
