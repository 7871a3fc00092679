"""Arrays of the compiled kernel, all flat and in single precision.

Runs are sorted by falling length, and a time step contains only runs that have not ended, so that padding
costs nothing. The rows of time step t begin at first[t]. In an array with `width` numbers per row, these rows
are the block that begins at first[t] * width.
"""

from typing import NamedTuple

import numpy as np

from pipeline.cam_follower.sequence.products import LEAST
from unmodelled.base.arrays import Indices, Single
from unmodelled.base.compiling import compiled


class Sizes(NamedTuple):
    """Sizes of a network."""

    features: int  # rounded up to a multiple of `LEAST`
    hidden: int  # size of the LSTM's state
    head: int  # hidden units of the ReLU network
    settings: int
    one: int = 1  # 1, hidden from the compiler (see `add_product`)

    @property
    def weights(self) -> int:
        """Number of all weights."""
        gates = 4 * self.hidden * (self.features + self.hidden + 1)
        return gates + self.head * (self.hidden + self.settings + 2) + 1


class Weights(NamedTuple):
    """Flat views of the vector of weights, in its order; the gates are input, forget, output, candidate."""

    tau: Single  # (4, features, hidden), from features to gates
    state: Single  # (4, hidden, hidden), from state to gates
    bias: Single  # (4, hidden), of the gates
    head_state: Single  # (hidden, head), from state to head
    head_setting: Single  # (settings, head), from settings to head
    head_bias: Single  # (head,)
    output: Single  # (head,)
    output_bias: Single  # (1,)


class Batch(NamedTuple):
    """Standardised runs of a mini-batch, the longest first."""

    tau: Single  # (rows, features), flat
    q: Single  # (runs, settings), flat
    target: Single  # (rows,), scaled
    share: Single  # (rows,), weights of the squared errors; zero for rows that only fill up a time step
    #: (steps + 1,), first rows of the time steps, and the number of all rows, multiples of `LEAST`
    first: Indices


class Work(NamedTuple):
    """Flat results of the forward pass that the backward pass needs.

    The states before the first time step are rows of zeros at the front.
    """

    gates: Single  # (4, rows, hidden) within a time step
    cell: Single  # (runs + rows, hidden)
    state: Single  # (runs + rows, hidden)
    squashed: Single  # (rows, hidden), hyperbolic tangents of the cell states
    units: Single  # (rows, head), after dropout
    output: Single  # (rows,)


@compiled
def views(p: Single, s: Sizes) -> Weights:
    """Split the vector of weights into its parts. Takes p (weights,)."""
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
    """Allocate arrays for any mini-batch of a set of runs. Takes lengths (runs,)."""
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
