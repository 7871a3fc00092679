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
    """Generated functions of a system, on a block w and the values v that all lanes of a stretch share."""

    #: drive(x, p, d, steps, h) writes the driven states after every step to x, whose first one is given; d
    #: has time and inputs at every half step
    drive: Any
    operating: Any  # operating(w, p, c) writes the constants of an operating point
    #: begin(w, v, d) writes the values that operating points share at the start; d has time, inputs and
    #: driven states at every half step
    begin: Any
    share: Any  # share(w, v, k, d, at, h) writes these values along step k; its clock begins at d[at]
    #: prepare(w, v) writes the constant values of an operating point, and the event's expression at the start
    prepare: Any
    #: advance(w, v, k, stop, h) takes the steps k to `stop`, or until the event's expression changes its sign
    #: in a lane, and returns the number of the step after the last one
    advance: Any
    middle: Any  # middle(w, v, i, k, h) returns the event's expression in lane i in the middle of step k


class Places(NamedTuple):
    """Rows of a block at which its parts begin, and numbers of rows."""

    sample: int  # first row of the uncertain parameters
    samples: int
    state: int  # first row of the shared states
    states: int
    own: int  # first row of the values of an operating point, which begin with its states
    own_rows: int
    own_states: int
    event: int  # row of the event's expression at the end of the last step
    event_before: int  # row of the event's expression at the start of the last step
    rows: int
    values: int  # number of shared values at one moment
    clock: int  # number of values of the clock at one moment


@jit()
def crossing(start, middle, end):
    """Return the share of a step at which the parabola through its three values falls through zero."""
    bend = 2.0 * (start - 2.0 * middle + end)
    slope = 4.0 * middle - 3.0 * start - end
    return 2.0 * start / (np.sqrt(max(0.0, slope * slope - 4.0 * bend * start)) - slope)


@jit()
def locate(middle, at, w, v, k, first, h, times):
    """Write the times (LANES,), s, of the events in step k of a stretch, and return how many lanes ended.

    The time of a lane is -1 before its event. A lane also ends where it diverges; its time is nan then.
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
    """Return event times (n, points), s, of operating points with the same input; nan: there is no event.

    Takes, beside functions (see `Generated`) and places: samples (n, uncertain) of the uncertain parameters,
    all parameters p (parameters,), starts of the shared states (shared states,) and of the others (points,
    own states), constants c (points, constants), all SI, the flat clock, the number of steps, and the step h
    in s.
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
