"""The recurrent network that predicts the detachment of the follower (section 5.4.2)."""

import numpy as np
import torch
from torch import Generator, Tensor, nn

from pipeline.cam_follower.sequences import SequenceInputs, Sequences
from unmodelled.base.arrays import Array
from unmodelled.base.errors import BadInput

#: Runs that are predicted together.
CHUNK = 256


class DetachmentNetwork(nn.Module):
    """Network R of eq. 5.7: an LSTM reads tau, a ReLU network maps its output and q_s to eps (eq. 5.8-5.12).

    Inputs are standardised and the output is scaled with statistics of the training runs, which belong to the
    network: `forward` takes and returns SI units, `scaled` standardised values. `hidden` and `head` are n_s
    and n_eta; `dropout` acts on the ReLU units. All arrays are (inputs,) or scalars.
    """

    feature_mean: Tensor
    feature_scale: Tensor
    setting_mean: Tensor
    setting_scale: Tensor
    target_scale: Tensor

    def __init__(
        self,
        inputs: SequenceInputs,
        hidden: int = 32,
        head: int = 32,
        dropout: float = 0.05,
        generator: Generator | None = None,
    ) -> None:
        super().__init__()
        self.inputs = inputs
        n_tau, n_q = len(inputs.features), len(inputs.settings)
        self.lstm = nn.LSTM(n_tau, hidden, batch_first=True)
        self.head = nn.Linear(hidden + n_q, head)
        self.dropout = nn.Dropout(dropout)
        self.output = nn.Linear(head, 1)
        self.register_buffer("feature_mean", torch.zeros(n_tau))
        self.register_buffer("feature_scale", torch.ones(n_tau))
        self.register_buffer("setting_mean", torch.zeros(n_q))
        self.register_buffer("setting_scale", torch.ones(n_q))
        self.register_buffer("target_scale", torch.ones(()))
        self._initialise(generator)

    @torch.no_grad()
    def _initialise(self, generator: Generator | None) -> None:
        """Glorot uniform, orthogonal where the state feeds back, zero biases but one for the forget gate."""
        n = self.lstm.hidden_size
        parameters = dict(self.named_parameters())
        for name in ("lstm.weight_ih_l0", "head.weight", "output.weight"):
            nn.init.xavier_uniform_(parameters[name], generator=generator)
        for gate in range(4):
            nn.init.orthogonal_(
                parameters["lstm.weight_hh_l0"][gate * n : (gate + 1) * n], generator=generator
            )
        for name in ("lstm.bias_ih_l0", "lstm.bias_hh_l0", "head.bias", "output.bias"):
            nn.init.zeros_(parameters[name])
        # torch's order of the gates is input, forget, candidate, output
        parameters["lstm.bias_ih_l0"][n : 2 * n] = 1.0

    def scale_to(self, training: Sequences) -> None:
        """Set the statistics to those of training runs: features over all samples, settings over all runs."""
        samples = training.features[training.mask]
        for name, values in (("feature", samples), ("setting", training.settings)):
            getattr(self, f"{name}_mean").copy_(torch.from_numpy(values.mean(0)))
            getattr(self, f"{name}_scale").copy_(torch.from_numpy(_spread(values)))
        self.target_scale.fill_(float(_spread(training.target[training.mask])))

    def scaled(self, tau: Tensor, q: Tensor) -> Tensor:
        """Return scaled outputs (runs, steps); tau (runs, steps, features), q (runs, settings)."""
        states: Tensor = self.lstm(tau)[0]
        settings = q[:, None, :].expand(-1, states.shape[1], -1)
        hidden = self.head(torch.cat([states, settings], -1)).relu()
        output: Tensor = self.output(self.dropout(hidden))
        return output[..., 0]

    def forward(self, tau: Tensor, q: Tensor) -> Tensor:
        """Return eps (runs, steps), m, for tau (runs, steps, features) and q (runs, settings)."""
        tau = (tau - self.feature_mean) / self.feature_scale
        return self.scaled(tau, (q - self.setting_mean) / self.setting_scale) * self.target_scale

    @torch.no_grad()
    def predict(self, sequences: Sequences) -> Array:
        """Predict the detachment eps of runs, without dropout; gives (runs, steps) in m."""
        if sequences.inputs != self.inputs:
            raise BadInput(f"the network reads {_listed(self.inputs)}, got {_listed(sequences.inputs)}")
        training, kind = self.training, self.output.weight
        self.train(False)
        eps = np.zeros(sequences.target.shape)
        for first in range(0, len(sequences), CHUNK):
            rows = slice(first, first + CHUNK)
            tau, q = (torch.from_numpy(a[rows]).to(kind) for a in (sequences.features, sequences.settings))
            eps[rows] = self(tau, q).double().cpu().numpy()
        self.train(training)
        return np.where(sequences.mask, eps, 0.0)


def _spread(values: Array) -> Array:
    """Standard deviation along the first axis; one for what never changes."""
    spread = np.std(values, axis=0)
    # rounding leaves a constant with a spread of about 1e-16 of its size
    return np.where(spread > 1e-12 * np.abs(values).max(axis=0, initial=0.0), spread, 1.0)


def _listed(inputs: SequenceInputs) -> str:
    return f"features {', '.join(inputs.features)} and settings {', '.join(inputs.settings) or 'none'}"
