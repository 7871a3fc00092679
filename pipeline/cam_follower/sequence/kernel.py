"""Compiled network: output, loss, and gradient of the loss by back-propagation through time."""

import numpy as np

from pipeline.cam_follower.sequence.activations import add_columns, copy, rectified, set_rows, sigmoid, tanh
from pipeline.cam_follower.sequence.arrays import Batch, Sizes, Weights, Work, views
from pipeline.cam_follower.sequence.products import add_product
from unmodelled.base.arrays import Single
from unmodelled.base.compiling import compiled

ZERO, ONE, TWO = (np.float32(x) for x in (0.0, 1.0, 2.0))


@compiled
def forward(w: Weights, batch: Batch, s: Sizes, work: Work, dropout: np.float32, seed: int) -> None:
    """Compute the outputs of a mini-batch, eq. 5.8 to 5.12."""
    H, F, N, first = s.hidden, s.features, s.head, batch.first
    runs = first[1]
    work.cell[: runs * H] = ZERO
    work.state[: runs * H] = ZERO
    constant = _constant(w, batch.q, s, runs)
    before = 0
    for t in range(len(first) - 1):
        a, n = first[t], first[t + 1] - first[t]
        m, after = n * H, (runs + a) * H
        gates = work.gates[4 * a * H : 4 * (a + n) * H]
        for k in range(4):
            gate = gates[k * m : (k + 1) * m]
            set_rows(gate, w.bias[k * H : (k + 1) * H])
            add_product(gate, 0, work.state, before, H, s.one, w.state, k * H * H, n, H, H)
            add_product(gate, 0, batch.tau, a * F, F, s.one, w.tau, k * F * H, n, F, H)
        sigmoid(gates[: 3 * m])
        tanh(gates[3 * m :])
        cell, squashed = work.cell[after : after + m], work.squashed[a * H : a * H + m]
        _remember(cell, work.cell[before : before + m], gates[:m], gates[m : 2 * m], gates[3 * m :])
        copy(squashed, cell)
        tanh(squashed)
        _multiply(work.state[after : after + m], gates[2 * m : 3 * m], squashed)
        units = work.units[a * N : (a + n) * N]
        copy(units, constant[: n * N])
        add_product(units, 0, work.state, after, H, s.one, w.head_state, 0, n, H, N)
        rectified(units, dropout, seed + a * N)
        _weigh(work.output[a : a + n], units, w.output, w.output_bias[0])
        before = after


@compiled
def gradient(
    p: Single, batch: Batch, s: Sizes, work: Work, dropout: np.float32, seed: int, slope: Single
) -> np.float32:
    """Compute loss (mean squared error, eq. 5.12) and gradient of a mini-batch at the weights (weights,)."""
    w, g = views(p, s), views(slope, s)
    forward(w, batch, s, work, dropout, seed)
    slope[:] = ZERO
    H, F, N, first = s.hidden, s.features, s.head, batch.first
    runs = first[1]
    constant = np.zeros(runs * N, np.float32)
    d_state, d_cell = np.zeros(runs * H, np.float32), np.zeros(runs * H, np.float32)
    back, head_back = _transposed(w.state, 4, H, H), _transposed(w.head_state, 1, H, N)
    loss = ZERO
    for t in range(len(first) - 2, -1, -1):
        a, n = first[t], first[t + 1] - first[t]
        m, after = n * H, (runs + a) * H
        before = 0 if t == 0 else (runs + first[t - 1]) * H
        units, error = work.units[a * N : (a + n) * N], work.output[a : a + n]
        loss += _error(error, batch.target[a : a + n], batch.share[a : a + n])
        _pull_output(units, error, w.output, g.output, g.output_bias, ONE / (ONE - dropout))
        add_product(g.head_state, 0, work.state, after, s.one, H, units, 0, H, n, N)
        _add(constant[: n * N], units)
        add_product(d_state[:m], 0, units, 0, N, s.one, head_back, 0, n, N, H)
        gates = work.gates[4 * a * H : 4 * (a + n) * H]
        squashed, previous = work.squashed[a * H : a * H + m], work.cell[before : before + m]
        _pull_gates(gates, squashed, previous, d_state[:m], d_cell[:m])
        d_state[:m] = ZERO
        for k in range(4):
            gate = gates[k * m : (k + 1) * m]
            add_columns(g.bias[k * H : (k + 1) * H], gate)
            add_product(g.state, k * H * H, work.state, before, s.one, H, gate, 0, H, n, H)
            add_product(g.tau, k * F * H, batch.tau, a * F, s.one, F, gate, 0, F, n, H)
            add_product(d_state[:m], 0, gate, 0, H, s.one, back, k * H * H, n, H, H)
    add_columns(g.head_bias, constant)
    _pull_settings(g.head_setting, constant, batch.q, s)
    return loss


@compiled
def _constant(w: Weights, q: Single, s: Sizes, runs: int) -> Single:
    """(runs, head) what settings and bias add to the head's units at every time step."""
    constant = np.empty(runs * s.head, np.float32)
    set_rows(constant, w.head_bias)
    for i in range(runs):
        for k in range(s.settings):
            for j in range(s.head):
                constant[i * s.head + j] += q[i * s.settings + k] * w.head_setting[k * s.head + j]
    return constant


@compiled
def _pull_settings(slope: Single, constant: Single, q: Single, s: Sizes) -> None:
    for i in range(len(constant) // s.head):
        for k in range(s.settings):
            for j in range(s.head):
                slope[k * s.head + j] += q[i * s.settings + k] * constant[i * s.head + j]


@compiled
def _remember(cell: Single, before: Single, i: Single, f: Single, candidate: Single) -> None:
    for j in range(len(cell)):
        cell[j] = f[j] * before[j] + i[j] * candidate[j]


@compiled
def _multiply(out: Single, a: Single, b: Single) -> None:
    for j in range(len(out)):
        out[j] = a[j] * b[j]


@compiled
def _add(out: Single, a: Single) -> None:
    for j in range(len(out)):
        out[j] += a[j]


@compiled
def _weigh(out: Single, units: Single, weights: Single, bias: np.float32) -> None:
    N = len(weights)
    for i in range(len(out)):
        row = units[i * N : (i + 1) * N]
        total = ZERO
        for j in range(N):
            total += row[j] * weights[j]
        out[i] = total + bias


@compiled
def _error(output: Single, target: Single, share: Single) -> np.float32:
    """The loss; its slope replaces the output."""
    loss = ZERO
    for i in range(len(output)):
        error = output[i] - target[i]
        loss += share[i] * error * error
        output[i] = TWO * share[i] * error
    return loss


@compiled
def _pull_output(
    units: Single, error: Single, weights: Single, slope: Single, bias: Single, scale: np.float32
) -> None:
    """The loss's slope by the units before rectifier and dropout replaces the units."""
    N = len(weights)
    for i in range(len(error)):
        row = units[i * N : (i + 1) * N]
        e = error[i]
        bias[0] += e
        for j in range(N):
            slope[j] += e * row[j]
        for j in range(N):
            row[j] = scale * e * weights[j] if row[j] > ZERO else ZERO


@compiled
def _pull_gates(gates: Single, squashed: Single, before: Single, d_state: Single, d_cell: Single) -> None:
    """The slopes by what enters the gates replace the gates; `d_cell` becomes that of the cell before.

    One loop for each gate: with more arrays in one loop the compiler gives up on vectors.
    """
    m = len(squashed)
    i, f, o, candidate = gates[:m], gates[m : 2 * m], gates[2 * m : 3 * m], gates[3 * m :]
    for j in range(m):
        d_cell[j] += d_state[j] * o[j] * (ONE - squashed[j] * squashed[j])
    for j in range(m):
        o[j] = d_state[j] * squashed[j] * o[j] * (ONE - o[j])
    for j in range(m):
        x, y = i[j], candidate[j]
        i[j] = d_cell[j] * y * x * (ONE - x)
        candidate[j] = d_cell[j] * x * (ONE - y * y)
    for j in range(m):
        x = f[j]
        f[j] = d_cell[j] * before[j] * x * (ONE - x)
        d_cell[j] *= x


@compiled
def _transposed(matrices: Single, count: int, rows: int, columns: int) -> Single:
    out = np.empty_like(matrices)
    for k in range(count):
        for i in range(rows):
            for j in range(columns):
                out[(k * columns + j) * rows + i] = matrices[(k * rows + i) * columns + j]
    return out
