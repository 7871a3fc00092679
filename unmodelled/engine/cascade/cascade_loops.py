"""Event times of one input for many samples and operating points, for any system.

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
    """Generated functions of a system, on a block w and the values v of a stretch that all lanes share.

    The step h is in s. The clock d contains time, inputs and driven states at every half step.

    Attributes:
        drive: drive(x, p, d, steps, h) writes the driven states after every step to x, whose first one is
            given; d contains time and inputs at every half step.
        operating: operating(w, p, c) writes the constants of an operating point.
        begin: begin(w, v, d) writes the values that operating points share at the start.
        share: share(w, v, k, d, at, h) writes these values along step k; its clock begins at d[at].
        prepare: prepare(w, v) writes the constant values of an operating point, and the event's expression at
            the start.
        advance: advance(w, v, k, stop, h) takes the steps k to `stop`, or until the event's expression
            changes its sign in a lane, and returns the number of the step after the last one.
        middle: middle(w, v, i, k, h) returns the event's expression in lane i in the middle of step k, the
            last one.
    """

    drive: Any
    operating: Any
    begin: Any
    share: Any
    prepare: Any
    advance: Any
    middle: Any


class Places(NamedTuple):
    """Rows of a block at which its parts begin, and numbers of rows.

    Attributes:
        sample: first row of the uncertain parameters.
        samples: number of uncertain parameters.
        state: first row of the shared states.
        states: number of shared states.
        own: first row of the values of an operating point, which begin with its states.
        own_rows: number of rows of an operating point.
        own_states: number of states of an operating point.
        event: row of the event's expression at the end of the last step.
        event_before: row of the event's expression at the start of the last step.
        rows: number of rows of the block.
        values: number of shared values at one moment.
        clock: number of values of the clock at one moment.
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
    """Return the share of a step at which the parabola through its three values falls through zero."""
    bend = 2.0 * (start - 2.0 * middle + end)
    slope = 4.0 * middle - 3.0 * start - end
    return 2.0 * start / (np.sqrt(max(0.0, slope * slope - 4.0 * bend * start)) - slope)


@jit()
def locate(middle, at, w, v, k, first, h, times):
    """Write the times of the lanes whose event happens in step k of a stretch, shape (LANES,), s.

    The time of a lane is -1 before its event. A lane also ends where it diverges; its time is nan then.

    Returns:
        Number of lanes that ended in this step.
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
    """Fill a block with samples, shape (n, uncertain), and `kept` with the values of all operating points."""
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
    """Write the shared values of a stretch of n steps that begins with step `first`."""
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
    """Return the event times of operating points with the same input.

    Args:
        operating: generated function, see `Generated`.
        begin: generated function.
        share: generated function.
        prepare: generated function.
        advance: generated function.
        middle: generated function.
        at: places in a block.
        samples: values of the uncertain parameters, shape (n, uncertain), SI.
        p: values of all parameters, shape (parameters,), SI.
        shared: starts of the shared states, shape (shared states,), SI.
        own: starts of the other states, shape (points, own states), SI.
        c: constants of the operating points, shape (points, constants), SI.
        clock: time, inputs and driven states at every half step, one moment after the other, flat.
        steps: number of steps.
        h: step, s.

    Returns:
        Event times, shape (n, points), s; nan where the event does not happen.
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
