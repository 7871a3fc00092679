"""Convert the weights of a network to the vector of the compiled kernel and back."""

import numpy as np
import torch

from pipeline.cam_follower.lstm import DetachmentNetwork
from pipeline.cam_follower.sequence.arrays import Sizes, filled_up, views
from pipeline.cam_follower.sequence.products import LEAST
from unmodelled.base.arrays import Single
from unmodelled.base.errors import BadInput

#: The kernel's order of the gates (input, forget, output, candidate) among torch's.
GATES = [0, 1, 3, 2]


def sizes(network: DetachmentNetwork) -> Sizes:
    """Return the sizes of a network."""
    hidden, head = network.lstm.hidden_size, network.head.out_features
    for name, size in (("hidden", hidden), ("head", head)):
        if size < 1 or size % LEAST:
            raise BadInput(f"{name} must be a multiple of {LEAST}, got {size}")
    return Sizes(filled_up(len(network.inputs.features)), hidden, head, len(network.inputs.settings))


def flattened(network: DetachmentNetwork) -> Single:
    """Return the weights (n,) in the order of `arrays.Weights`; the biases of torch's LSTM are summed."""
    s = sizes(network)
    state = {name: tensor.detach().cpu().numpy() for name, tensor in network.state_dict().items()}
    p = np.zeros(s.weights, np.float32)
    w = views(p, s)
    tau = w.tau.reshape(4, s.features, s.hidden)
    tau[:, : len(network.inputs.features)] = _by_gate(state["lstm.weight_ih_l0"])
    w.state.reshape(4, s.hidden, s.hidden)[:] = _by_gate(state["lstm.weight_hh_l0"])
    w.bias.reshape(4, 1, s.hidden)[:] = _by_gate(state["lstm.bias_ih_l0"] + state["lstm.bias_hh_l0"])
    w.head_state.reshape(s.hidden, s.head)[:] = state["head.weight"][:, : s.hidden].T
    w.head_setting.reshape(s.settings, s.head)[:] = state["head.weight"][:, s.hidden :].T
    w.head_bias[:], w.output[:], w.output_bias[:] = (
        state[name].ravel() for name in ("head.bias", "output.weight", "output.bias")
    )
    return p


def _by_gate(matrix: Single) -> Single:
    """(4, columns, hidden) in the kernel's order of a matrix (4 hidden, columns) in torch's."""
    return matrix.reshape(4, len(matrix) // 4, -1)[GATES].transpose(0, 2, 1)


@torch.no_grad()
def restore(network: DetachmentNetwork, p: Single) -> None:
    """Copy a vector of weights into a network. Takes p (weights,)."""
    s = sizes(network)
    w = views(np.ascontiguousarray(p), s)
    tau = w.tau.reshape(4, s.features, s.hidden)[:, : len(network.inputs.features)]
    bias = _by_unit(w.bias.reshape(4, 1, s.hidden))[:, 0]
    setting = w.head_setting.reshape(s.settings, s.head)
    head = np.concatenate([w.head_state.reshape(s.hidden, s.head), setting]).T
    new = {
        "lstm.weight_ih_l0": _by_unit(tau),
        "lstm.weight_hh_l0": _by_unit(w.state.reshape(4, s.hidden, s.hidden)),
        "lstm.bias_ih_l0": bias,
        "lstm.bias_hh_l0": np.zeros_like(bias),
        "head.weight": head,
        "head.bias": w.head_bias,
        "output.weight": w.output[None],
        "output.bias": w.output_bias,
    }
    for name, parameter in network.named_parameters():
        parameter.copy_(torch.from_numpy(np.ascontiguousarray(new[name])))


def _by_unit(matrices: Single) -> Single:
    """The inverse of `_by_gate`."""
    return matrices[np.argsort(GATES)].transpose(0, 2, 1).reshape(4 * matrices.shape[2], -1)
