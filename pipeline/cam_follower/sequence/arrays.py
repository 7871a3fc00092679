"""Arrays of the compiled kernel, all flat and in single precision.

Runs are sorted by falling length, and a time step contains only runs that have not ended, so that padding
costs nothing. The rows of time step t begin at first[t]. In an array with `width` numbers per row, these rows
are the block that begins at first[t] * width.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.arrays import Indices, Single
from pipeline.cam_follower.sequence.products import LEAST
from unmodelled.base.compiling import compiled


class Sizes(NamedTuple):
    """Sizes of a network.

    Attributes:
        features: number of features, rounded up to a multiple of `LEAST`.
        hidden: size of the LSTM's state.
        head: number of hidden units of the ReLU network.
        settings: number of settings.
        one: the number 1, hidden from the compiler (see `add_product`).
    """

    features: int
    hidden: int
    head: int
    settings: int
    one: int = 1

    @property
    def weights(self) -> int:
        """Number of all weights."""
        gates = 4 * self.hidden * (self.features + self.hidden + 1)
        return gates + self.head * (self.hidden + self.settings + 2) + 1


class Weights(NamedTuple):
    """Views of the vector of weights, in its order; the order of the gates is input, forget, output,
    candidate.

    Attributes:
        tau: weights from features to gates, flat, shape (4, features, hidden).
        state: weights from state to gates, flat, shape (4, hidden, hidden).
        bias: biases of the gates, flat, shape (4, hidden).
        head_state: weights from state to head, flat, shape (hidden, head).
        head_setting: weights from settings to head, flat, shape (settings, head).
        head_bias: biases of the head, shape (head,).
        output: weights of the output, shape (head,).
        output_bias: bias of the output, shape (1,).
    """

    tau: Single
    state: Single
    bias: Single
    head_state: Single
    head_setting: Single
    head_bias: Single
    output: Single
    output_bias: Single


class Batch(NamedTuple):
    """Standardised runs of a mini-batch, the longest first.

    Attributes:
        tau: features, flat, shape (rows, features).
        q: settings, flat, shape (runs, settings).
        target: scaled targets, shape (rows,).
        share: weights of the squared errors, shape (rows,); zero for rows that only fill up a time step.
        first: first rows of the time steps, and the number of all rows, multiples of `LEAST`, shape (steps +
            1,).
    """

    tau: Single
    q: Single
    target: Single
    share: Single
    first: Indices


class Work(NamedTuple):
    """Results of the forward pass that the backward pass needs.

    The states before the first time step are rows of zeros at the front.

    Attributes:
        gates: gates of every time step, flat, shape (4, rows, hidden) within a time step.
        cell: cell states, flat, shape (runs + rows, hidden).
        state: hidden states, flat, shape (runs + rows, hidden).
        squashed: hyperbolic tangents of the cell states, flat, shape (rows, hidden).
        units: units of the head after dropout, flat, shape (rows, head).
        output: outputs, shape (rows,).
    """

    gates: Single
    cell: Single
    state: Single
    squashed: Single
    units: Single
    output: Single


@compiled
def views(p: Single, s: Sizes) -> Weights:
    """Split the vector of weights into its parts.

    Takes p (weights,).
    """
    a = 4 * s.features * s.hidden
    b = a + 4 * s.hidden * s.hidden
    c = b + 4 * s.hidden
    d = c + s.hidden * s.head
    e = d + s.settings * s.head
    f = e + s.head
    g = f + s.head
    return Weights(p[:a], p[a:b], p[b:c], p[c:d], p[d:e], p[e:f], p[f:g], p[g:])


def filled_up(count: int) -> int:
    """Round up to the next multiple of `LEAST`."""
    return -(-count // LEAST) * LEAST


def room(lengths: Indices, batch: int, s: Sizes) -> tuple[Batch, Work]:
    """Allocate arrays for any mini-batch of a set of runs.

    Takes lengths (runs,).
    """
    longest = np.sort(lengths)[::-1][:batch]
    active = np.count_nonzero(longest > np.arange(longest[0])[:, None], axis=1)
    runs, rows = filled_up(batch), int((active + LEAST - 1).sum())

    def single(size: int) -> Single:
        return np.zeros(size, np.float32)

    first = np.zeros(int(longest[0]) + 1, np.int64)
    loaded = Batch(single(rows * s.features), single(runs * s.settings), single(rows), single(rows), first)
    state = (rows + runs) * s.hidden
    sizes = (4 * rows * s.hidden, state, state, rows * s.hidden, rows * s.head, rows)
    return loaded, Work(*(single(size) for size in sizes))
