"""Loops that all kernels share, for any system: integration and back-propagation through time.

The physics comes as two compiled functions of a block, `evaluate(w, p)` and `pull(w, p)` (see `source.py`),
so that these loops are compiled once and for all. `stages` (S, 3) are coefficient on the stage before,
weight, and time of every stage of an explicit Runge-Kutta method.
"""

# mypy: ignore-errors

from typing import NamedTuple

import numpy as np
from numba import types

from unmodelled.engine.compiled.layout import LANES, Array, jit

f, i = types.float64, types.int64
Rows, Cubes, Indices = types.float64[:, ::1], types.float64[:, :, ::1], types.int64[::1]
#: U, C, T, steps, substeps, period, hold, stages, p, weights, scale, gain
COMMON = (Rows, Rows, Array, i, i, f, f, Rows, Array, Array, Array, Array)

#: An index of this type cannot count from the end: what runs over such indices fills vector registers.
place = np.uint64
WIDE, ONE = place(LANES), place(1)


@jit()
def copy(to, start, values, base, n):
    # slices of arrays take long to compile
    there, here = place(start), place(base)
    for a in range(place(n)):
        to[there + a] = values[here + a]


@jit()
def fill(w, row, values):
    for j in range(len(values)):
        w[row * LANES + j] = values[j]


@jit()
def load_inputs(w, at, U, first, k, share, hold, period, T):
    """Write inputs and time of all lanes at a share (0 to 1) of a period after sample k.

    Inputs are held with `hold` 0, and run straight to the next sample with `hold` 1.
    """
    u, t, sample = place(at.u) * WIDE, place(at.t) * WIDE, place(k)
    for j in range(place(at.inputs)):
        for lane in range(WIDE):
            row = place(first[lane]) + sample
            now = U[row, j]
            w[u + j * WIDE + lane] = now if hold == 0.0 else now + hold * share * (U[row + ONE, j] - now)
    for lane in range(WIDE):
        w[t + lane] = T[place(first[lane]) + sample] + share * period


@jit()
def load_constants(w, at, C, first, owner):
    for j in range(at.constants):
        for lane in range(LANES):
            w[(at.c + j) * LANES + lane] = C[owner[first[lane]], j]


@jit()
def load_step(w, at, part):
    for lane in range(LANES):
        w[at.h * LANES + lane] = part


@jit()
def load_state(w, at, x, K, factor):
    """Write the state of a stage: x plus `factor` times the rates K of the stage before."""
    n = at.states * LANES
    if factor == 0.0:
        copy(w, at.x * LANES, x, 0, n)
    else:
        here = place(at.x) * WIDE
        for a in range(place(n)):
            w[here + a] = x[a] + factor * K[a]


@jit()
def keep(w, at, to, start):
    """Copy the state and the networks' efforts of a stage to `to`; `pull` needs no other values of it."""
    n, m = at.states * LANES, at.networks * LANES
    copy(to, start, w, at.x * LANES, n)
    copy(to, start + n, w, at.z * LANES, m)


class Room(NamedTuple):
    """Flat arrays that a block needs for `forward` and `backward`.

    xs (steps + 1, states, LANES) are the states, gs the gradient by them; zs (steps, networks, LANES) are the
    efforts of the networks, gz the gradient by them; trace holds the stages of all steps, see `keep`.
    """

    xs: np.ndarray
    gs: np.ndarray
    zs: np.ndarray
    gz: np.ndarray
    trace: np.ndarray


@jit()
def new_room(at, steps, substeps, stages):
    """Return the arrays of a block, without values."""
    states, efforts = (steps + 1) * at.states * LANES, steps * at.networks * LANES
    stage = (at.states + at.networks) * LANES
    return Room(
        np.empty(states),
        np.empty(states),
        np.empty(efforts),
        np.empty(efforts),
        np.empty(steps * substeps * len(stages) * stage),
    )


@jit()
def forward(evaluate, at, w, X, Z, trace, first, U, T, steps, substeps, period, hold, stages, p):
    """Integrate the windows of a block, and write their states and the efforts of the networks.

    X (steps + 1, states, LANES) are the states, flat, of which the first sample is given, Z (steps, networks,
    LANES) the efforts, flat. The stages of all steps are written to `trace` unless it is empty.
    """
    n, m, S = at.states * LANES, at.networks * LANES, len(stages)
    part, dx = period / substeps, place(at.dx) * WIDE
    K, last, total = np.zeros(n), np.empty(n), np.empty(n)
    load_step(w, at, part)
    for k in range(steps):
        copy(last, 0, X, k * n, n)
        for sub in range(substeps):
            for a in range(n):
                total[a] = 0.0
            for s in range(S):
                load_state(w, at, last, K, part * stages[s, 0])
                load_inputs(w, at, U, first, k, (sub + stages[s, 2]) / substeps, hold, period, T)
                evaluate(w, p)
                if len(trace):
                    keep(w, at, trace, ((k * substeps + sub) * S + s) * (n + m))
                if s == 0 and sub == 0:
                    copy(Z, k * m, w, at.z * LANES, m)
                for a in range(place(n)):
                    K[a] = w[dx + a]
                    total[a] += stages[s, 1] * K[a]
            for a in range(n):
                last[a] += part * total[a]
        copy(X, (k + 1) * n, last, 0, n)


@jit()
def backward(pull, at, w, trace, G, GZ, first, U, T, steps, substeps, period, hold, stages, p):
    """Propagate the gradient of the loss back through time; it is added to gp and gw of the block.

    G, of the shape of X in `forward`, is the gradient by the states of every sample; its first sample becomes
    the gradient by the initial states. GZ, of the shape of Z, is the gradient by the efforts of the networks.
    `trace` was written by `forward`.
    """
    n, m, S = at.states * LANES, at.networks * LANES, len(stages)
    part = period / substeps
    lam, grow = np.empty(n), np.empty(S * n)
    gx, gz = place(at.gx) * WIDE, place(at.gz) * WIDE
    load_step(w, at, part)
    for k in range(steps - 1, -1, -1):
        copy(lam, 0, G, (k + 1) * n, n)
        for sub in range(substeps - 1, -1, -1):
            for s in range(S):
                there = place(s * n)
                for a in range(place(n)):
                    grow[there + a] = part * stages[s, 1] * lam[a]
            for s in range(S - 1, -1, -1):
                kept = ((k * substeps + sub) * S + s) * (n + m)
                copy(w, at.x * LANES, trace, kept, n)
                copy(w, at.z * LANES, trace, kept + n, m)
                load_inputs(w, at, U, first, k, (sub + stages[s, 2]) / substeps, hold, period, T)
                own, here = s == 0 and sub == 0, place(k * m)
                for a in range(place(m)):
                    w[gz + a] = GZ[here + a] if own else 0.0
                copy(w, at.lam * LANES, grow, s * n, n)
                pull(w, p)
                for a in range(place(n)):
                    lam[a] += w[gx + a]
                if s > 0:
                    before = place((s - 1) * n)
                    for a in range(place(n)):
                        grow[before + a] += part * stages[s, 0] * w[gx + a]
        here = place(k * n)
        for a in range(place(n)):
            G[here + a] += lam[a]


@jit()
def collect(w, at, gp, gW):
    """Add gp and gw of the block to the gradients, and clear them."""
    for j in range(at.trained):
        for a in range((at.gp + j) * LANES, (at.gp + j + 1) * LANES):
            gp[j] += w[a]
            w[a] = 0.0
    for j in range(at.size):
        gW[j] += w[at.gw * LANES + j]
        w[at.gw * LANES + j] = 0.0


@jit()
def new_block(at, weights, scale, gain):
    w = np.zeros(at.rows * LANES)
    fill(w, at.weights, weights)
    fill(w, at.scale, scale)
    fill(w, at.gain, gain)
    return w


@jit()
def gather(flat, values, block, steps):
    """Copy values, shape (windows, steps, k), to lanes; lanes without a window get the last window again."""
    B, _, width = values.shape
    for lane in range(LANES):
        b = min(block + lane, B - 1)
        for k in range(steps):
            for j in range(width):
                flat[(k * width + j) * LANES + lane] = values[b, k, j]


@jit()
def scatter(values, flat, block, steps):
    """Copy lanes back to values, shape (windows, steps, k): the inverse of `gather`."""
    B, _, width = values.shape
    for lane in range(min(LANES, B - block)):
        for k in range(steps):
            for j in range(width):
                values[block + lane, k, j] = flat[(k * width + j) * LANES + lane]
