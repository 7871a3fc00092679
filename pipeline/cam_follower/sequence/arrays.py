"""The arrays that the compiled kernel works on, all flat and in single precision.

Runs are sorted by falling length, and only those that still go on take part in a time step, so that padding
costs nothing. The rows of time step t begin at first[t]; in an array with `width` numbers per row they are
the block that begins at first[t] * width.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.cam_follower.sequence.products import LEAST
from unmodelled.base.compiling import compiled

Single = NDArray[np.float32]
Indices = NDArray[np.int64]


class Sizes(NamedTuple):
    """Of a network: features (filled up to a multiple of `LEAST`), state, head, settings; and the number 1,
    which the compiler must not know (see `add_product`).
    """

    features: int
    hidden: int
    head: int
    settings: int
    one: int = 1

    @property
    def weights(self) -> int:
        """Length of the vector of weights."""
        gates = 4 * self.hidden * (self.features + self.hidden + 1)
        return gates + self.head * (self.hidden + self.settings + 2) + 1


class Weights(NamedTuple):
    """Views of one vector, in its order; gates are input, forget, output, candidate.

    Attributes:
        tau: (4, features, hidden). state: (4, hidden, hidden). bias: (4, hidden).
        head_state: (hidden, head). head_setting: (settings, head). head_bias: (head,).
        output: (head,). output_bias: (1,).
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
    """Runs that are worked on together, longest first, standardised.

    Attributes:
        tau: (rows, features). q: (runs, settings).
        target: (rows,) scaled. share: (rows,) what a squared error counts; zero for rows that fill up.
        first: (steps + 1,) where the rows of a time step begin, multiples of `LEAST`.
    """

    tau: Single
    q: Single
    target: Single
    share: Single
    first: Indices


class Work(NamedTuple):
    """What the backward pass needs of the forward pass; the states before the first step are zero rows in
    front.

    Attributes:
        gates: per time step (4, rows, hidden). cell, state: (runs + rows, hidden).
        squashed: (rows, hidden), tanh of the cell. units: (rows, head) of the head, after dropout.
        output: (rows,).
    """

    gates: Single
    cell: Single
    state: Single
    squashed: Single
    units: Single
    output: Single


@compiled
def views(p: Single, s: Sizes) -> Weights:
    """The weights in the vector `p`."""
    a = 4 * s.features * s.hidden
    b = a + 4 * s.hidden * s.hidden
    c = b + 4 * s.hidden
    d = c + s.hidden * s.head
    e = d + s.settings * s.head
    f = e + s.head
    g = f + s.head
    return Weights(p[:a], p[a:b], p[b:c], p[c:d], p[d:e], p[e:f], p[f:g], p[g:])


def filled_up(count: int) -> int:
    """The next multiple of `LEAST`."""
    return -(-count // LEAST) * LEAST


def room(lengths: Indices, batch: int, s: Sizes) -> tuple[Batch, Work]:
    """Arrays for any mini-batch of at most `batch` runs out of runs of the given lengths."""
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
