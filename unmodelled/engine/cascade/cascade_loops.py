"""Event times of one input for many samples and operating points, whatever the system.

The physics comes as compiled functions of a block (see `cascade_source.py`), so that this loop is compiled
once and for all.
"""

# mypy: ignore-errors

from typing import Any, NamedTuple

import numpy as np
from numba import types

from unmodelled.engine.compiled.layout import Array, entry, jit
from unmodelled.engine.compiled.loops import copy

#: Samples side by side in a block.
LANES = 32
#: Steps whose shared values are computed at a time: they stay in the processor's first cache.
STRETCH = 32

f, i = types.float64, types.int64
Rows = types.float64[:, ::1]
DRIVE = types.void(Array, Array, Array, i, f)
OPERATING = types.void(Array, Array, Array)
BEGIN = types.void(Array, Array, Array)
SHARE = types.void(Array, Array, i, Array, i, f)
PREPARE = types.void(Array, Array)
ADVANCE = i(Array, Array, i, i, f)
MIDDLE = f(Array, Array, i, i, f)
FUNCTIONS = tuple(map(types.FunctionType, (OPERATING, BEGIN, SHARE, PREPARE, ADVANCE, MIDDLE)))


class Generated(NamedTuple):
    """The generated functions of a block `w`, shared values `v` of a stretch by half steps, and a step `h`.

    drive(x, p, d, steps, h): driven states after every step, from time and inputs `d` at every half step.
    operating(w, p, c): constants from the parameters and the operating point.
    begin(w, v, d): what operating points share at the start; `d` is the clock.
    share(w, v, k, d, at, h): the same along step k of the stretch, for which the clock begins at d[at].
    prepare(w, v): what stays the same for an operating point, and the event's expression at the start.
    advance(w, v, k, stop, h): steps k to `stop`, or until that expression changes its sign in some lane;
    returns the step after the last.
    middle(w, v, i, k, h): the expression in the middle of the last step, which was k, in lane i.
    """

    drive: Any
    operating: Any
    begin: Any
    share: Any
    prepare: Any
    advance: Any
    middle: Any


class Places(NamedTuple):
    """Where the loop finds what in a block: first rows, and how many there are.

    sample: of the `samples` uncertain parameters. state: of the `states` shared states. own: of the
    `own_rows` of an operating point, which begin with its `own_states` states. event, event_before: of the
    event's expression at the end and the start of the last step. rows: of the block. values: shared at one
    moment. clock: numbers of one moment.
    """

    sample: int
    samples: int
    state: int
    states: int
    own: int
    own_rows: int
    own_states: int
    event: int
    event_before: int
    rows: int
    values: int
    clock: int


@jit()
def crossing(start, middle, end):
    """Where in a step, as a share of it, the parabola through its three values falls through zero."""
    bend = 2.0 * (start - 2.0 * middle + end)
    slope = 4.0 * middle - 3.0 * start - end
    return 2.0 * start / (np.sqrt(max(0.0, slope * slope - 4.0 * bend * start)) - slope)


@jit()
def locate(middle, at, w, v, k, first, h, times):
    """Write the times (LANES,) of lanes that fell through zero in step k of a stretch; -1 before.

    A lane ends there, or where it diverges, which leaves nan. Returns how many ended.
    """
    ended = 0
    for lane in range(LANES):
        start, end = w[at.event_before * LANES + lane], w[at.event * LANES + lane]
        if times[lane] == -1.0 and start > 0.0 and not end > 0.0:
            times[lane] = (first + k + crossing(start, middle(w, v, lane, k, h), end)) * h
            ended += 1
    return ended


@jit()
def fill(w, row, value):
    for lane in range(LANES):
        w[row * LANES + lane] = value


@jit()
def load(operating, begin, prepare, at, w, v, samples, block, p, shared, own, c, clock, kept):
    """Fill a block with samples (n, uncertain), and `kept` with what belongs to every operating point."""
    size = at.own_rows * LANES
    for lane in range(LANES):
        row = min(block + lane, len(samples) - 1)
        for j in range(at.samples):
            w[(at.sample + j) * LANES + lane] = samples[row, j]
    for j in range(at.states):
        fill(w, at.state + j, shared[j])
    operating(w, p, c[0])
    begin(w, v, clock)
    for q in range(len(own)):
        for j in range(at.own_states):
            fill(w, at.own + j, own[q, j])
        operating(w, p, c[q])
        prepare(w, v)
        copy(kept, q * size, w, at.own * LANES, size)


@jit()
def along(share, at, w, v, clock, first, n, h):
    """Shared values of a stretch of n steps that begins with step `first`."""
    size = at.values * LANES
    if first > 0:
        copy(v, 0, v, 2 * STRETCH * size, size)  # where the stretch before ended
    for k in range(n):
        share(w, v, k, clock, 2 * (first + k) * at.clock, h)


PlacesType = types.NamedUniTuple(types.int64, len(Places._fields), Places)


@entry(Rows(*FUNCTIONS, PlacesType, Rows, Array, Array, Rows, Rows, Array, i, f))
def event_times(
    operating, begin, share, prepare, advance, middle, at, samples, p, shared, own, c, clock, steps, h
):
    """Times (n, points) s of one input; nan where nothing falls through zero.

    samples (n, uncertain) values; p all parameters; shared starts of the shared states; own (points, states)
    starts of the others; c (points, constants); clock time, inputs and driven states at every half step, one
    after the other.
    """
    points, size = len(own), at.own_rows * LANES
    found = np.empty((len(samples), points))
    w, v = np.zeros(at.rows * LANES), np.zeros((2 * STRETCH + 1) * at.values * LANES)
    kept, times = np.empty(points * size), np.empty((points, LANES))
    left = np.empty(points, np.int64)
    for block in range(0, len(samples), LANES):
        load(operating, begin, prepare, at, w, v, samples, block, p, shared, own, c, clock, kept)
        times[:] = -1.0
        left[:] = LANES
        first = 0
        while first < steps and left.max() > 0:
            n = min(STRETCH, steps - first)
            along(share, at, w, v, clock, first, n, h)
            for q in range(points):
                k = 0
                copy(w, at.own * LANES, kept, q * size, size)
                while k < n and left[q] > 0:
                    k = advance(w, v, k, n, h)
                    left[q] -= locate(middle, at, w, v, k - 1, first, h, times[q])
                copy(kept, q * size, w, at.own * LANES, size)
            first += n
        for lane in range(min(LANES, len(samples) - block)):
            for q in range(points):
                found[block + lane, q] = times[q, lane] if times[q, lane] >= 0.0 else np.nan
    return found
