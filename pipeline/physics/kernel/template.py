"""The part of every kernel that knows no physics: integration, back-propagation through time, training.

`compiled.py` puts the generated functions of one system after the line of dashes of the first part and compiles the
whole. Everything works on blocks of `LANES` samples in one flat array `w`; see `source.py`.
"""
# ruff: noqa: F821 - names that the generated part defines
# mypy: ignore-errors

import math

import numba
import numpy as np

jit = numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz"}, nogil=True)
# sums over hidden units may be taken in any order
jit_sums = numba.njit(cache=True, error_model="numpy", fastmath={"contract", "nsz", "reassoc"}, nogil=True)


@jit
def sin(x):
    """Sine by Cody-Waite reduction and polynomials (Cephes): no branches, so that it vectorises."""
    k = math.floor(x * 0.6366197723675814 + 0.5)
    r = ((x - k * 1.5707963267341256) - k * 6.077100506303966e-11) - k * 2.0222662487959506e-21
    z = r * r
    s = r + r * z * (
        -1.66666666666666307295e-1
        + z
        * (
            8.33333333332211858878e-3
            + z
            * (
                -1.98412698295895385996e-4
                + z
                * (
                    2.75573136213857245213e-6
                    + z * (-2.50507477628578072866e-8 + z * 1.58962301576546568060e-10)
                )
            )
        )
    )
    c = (
        1.0
        - 0.5 * z
        + z
        * z
        * (
            4.16666666666665929218e-2
            + z
            * (
                -1.38888888888730564116e-3
                + z
                * (
                    2.48015872888517045348e-5
                    + z
                    * (
                        -2.75573141792967388112e-7
                        + z * (2.08757008419747316778e-9 + z * -1.13585365213876817300e-11)
                    )
                )
            )
        )
    )
    quarter = k - 4.0 * math.floor(k * 0.25)
    value = c if (quarter == 1.0 or quarter == 3.0) else s
    return -value if quarter >= 2.0 else value


@jit
def cos(x):
    """Cosine; loses at most one digit in shifting the argument where |x| stays below a few thousand turns."""
    k = math.floor(x * 0.6366197723675814 + 0.5)
    r = ((x - k * 1.5707963267341256) - k * 6.077100506303966e-11) - k * 2.0222662487959506e-21
    z = r * r
    s = r + r * z * (
        -1.66666666666666307295e-1
        + z
        * (
            8.33333333332211858878e-3
            + z
            * (
                -1.98412698295895385996e-4
                + z
                * (
                    2.75573136213857245213e-6
                    + z * (-2.50507477628578072866e-8 + z * 1.58962301576546568060e-10)
                )
            )
        )
    )
    c = (
        1.0
        - 0.5 * z
        + z
        * z
        * (
            4.16666666666665929218e-2
            + z
            * (
                -1.38888888888730564116e-3
                + z
                * (
                    2.48015872888517045348e-5
                    + z
                    * (
                        -2.75573141792967388112e-7
                        + z * (2.08757008419747316778e-9 + z * -1.13585365213876817300e-11)
                    )
                )
            )
        )
    )
    quarter = k - 4.0 * math.floor(k * 0.25)
    value = s if (quarter == 1.0 or quarter == 3.0) else c
    return -value if (quarter == 1.0 or quarter == 2.0) else value


@jit
def sgn(x):
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@jit
def step(x):
    return 1.0 if x > 0.0 else (0.0 if x < 0.0 else 0.5)


@jit
def whole(x):
    return math.floor(x)


@jit
def greater(a, b):
    return 1.0 if a > b else 0.0


@jit
def at_least(a, b):
    return 1.0 if a >= b else 0.0


@jit
def equal(a, b):
    return 1.0 if a == b else 0.0


@jit
def absolute(x):
    return abs(x)


@jit
def minimum(a, b):
    return a if a < b else b


@jit
def maximum(a, b):
    return a if a > b else b


@jit
def select(condition, a, b):
    return a if condition != 0.0 else b


@jit
def piece(x, knots, c):
    low, high = 0, len(knots) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if knots[middle] <= x:
            low = middle
        else:
            high = middle
    d = x - knots[low]
    return ((c[low, 0] * d + c[low, 1]) * d + c[low, 2]) * d + c[low, 3]


# --- generated -------------------------------------------------------------------------------------------------------


@jit
def load_inputs(w, U, first, k, share, hold, period, T):
    """Inputs and time of all lanes `share` of a period after sample k; `hold` 1 goes straight to the next sample."""
    for i in range(LANES):
        row = first[i] + k
        for j in range(INPUTS):
            now = U[row, j]
            w[(R_u + j) * LANES + i] = now if hold == 0.0 else now + hold * share * (U[row + 1, j] - now)
        w[R_t * LANES + i] = T[row] + share * period


@jit
def evaluate(w, p, scale, gain):
    """dx of the block at its state and inputs."""
    for i in range(PORTS * LANES):
        w[R_e * LANES + i] = 0.0
    if NETWORKS > 0:
        network_inputs(w, p)
        networks(w, scale, gain)
        for k in range(NETWORKS):
            for i in range(LANES):
                w[(R_e + PORT_OF[k]) * LANES + i] += w[(R_z + k) * LANES + i]
    derivative(w, p)


@jit
def pull(w, p, scale, gain):
    """gx from lam at the state that was evaluated last; gp and gw grow. gz enters with what the loss says of z."""
    derivative_pullback(w, p)
    if NETWORKS > 0:
        for k in range(NETWORKS):
            for i in range(LANES):
                w[(R_gz + k) * LANES + i] += w[(R_ge + PORT_OF[k]) * LANES + i]
        networks_pullback(w, scale, gain)
        inputs_pullback(w, p)


@jit
def forward(w, X, Z, first, steps, substeps, h, hold, stages, p, scale, gain, U, T):
    """Roll a block out: X (steps + 1, STATES, LANES) flat, its first sample given; Z (steps, NETWORKS, LANES) flat.

    `stages` (S, 3): coefficient on the stage before, weight, and time of every stage of the Runge-Kutta method.
    """
    n = STATES * LANES
    part = h / substeps
    K = np.empty(n)
    last = np.empty(n)
    total = np.empty(n)
    for k in range(steps):
        for i in range(n):
            last[i] = X[k * n + i]
        for sub in range(substeps):
            for i in range(n):
                total[i] = 0.0
            for s in range(len(stages)):
                for i in range(n):
                    w[R_x * LANES + i] = last[i] if s == 0 else last[i] + part * stages[s, 0] * K[i]
                load_inputs(w, U, first, k, (sub + stages[s, 2]) / substeps, hold, h, T)
                evaluate(w, p, scale, gain)
                if s == 0 and sub == 0:
                    for i in range(NETWORKS * LANES):
                        Z[k * NETWORKS * LANES + i] = w[R_z * LANES + i]
                for i in range(n):
                    K[i] = w[R_dx * LANES + i]
                    total[i] += stages[s, 1] * K[i]
            for i in range(n):
                last[i] = last[i] + part * total[i]
        for i in range(n):
            X[(k + 1) * n + i] = last[i]


@jit
def backward(w, X, G, GZ, first, steps, substeps, h, hold, stages, p, scale, gain, U, T):
    """Back-propagation through time: G (like X) holds the loss's gradient by every sample; its first becomes x0's.

    GZ (like Z) is the loss's own gradient by the networks' efforts. gp and gw of the block grow.
    """
    n = STATES * LANES
    S = len(stages)
    part = h / substeps
    inner = np.empty((substeps + 1) * n)
    K = np.empty(S * n)
    lam = np.empty(n)
    grow = np.empty(S * n)
    for k in range(steps - 1, -1, -1):
        for i in range(n):
            inner[i] = X[k * n + i]
            lam[i] = G[(k + 1) * n + i]
        # the samples between, and the stages, are cheaper to make again than to keep
        for sub in range(substeps - 1):
            for i in range(n):
                inner[(sub + 1) * n + i] = inner[sub * n + i]
            for s in range(S):
                for i in range(n):
                    before = part * stages[s, 0] * K[(s - 1) * n + i] if s > 0 else 0.0
                    w[R_x * LANES + i] = inner[sub * n + i] + before
                load_inputs(w, U, first, k, (sub + stages[s, 2]) / substeps, hold, h, T)
                evaluate(w, p, scale, gain)
                for i in range(n):
                    K[s * n + i] = w[R_dx * LANES + i]
                    inner[(sub + 1) * n + i] += part * stages[s, 1] * K[s * n + i]
        for sub in range(substeps - 1, -1, -1):
            for s in range(S - 1):
                for i in range(n):
                    before = part * stages[s, 0] * K[(s - 1) * n + i] if s > 0 else 0.0
                    w[R_x * LANES + i] = inner[sub * n + i] + before
                load_inputs(w, U, first, k, (sub + stages[s, 2]) / substeps, hold, h, T)
                evaluate(w, p, scale, gain)
                for i in range(n):
                    K[s * n + i] = w[R_dx * LANES + i]
            for s in range(S):
                for i in range(n):
                    grow[s * n + i] = part * stages[s, 1] * lam[i]
            for s in range(S - 1, -1, -1):
                for i in range(n):
                    before = part * stages[s, 0] * K[(s - 1) * n + i] if s > 0 else 0.0
                    w[R_x * LANES + i] = inner[sub * n + i] + before
                    w[R_lam * LANES + i] = grow[s * n + i]
                load_inputs(w, U, first, k, (sub + stages[s, 2]) / substeps, hold, h, T)
                if NETWORKS > 0:
                    evaluate(w, p, scale, gain)
                for i in range(NETWORKS * LANES):
                    own = s == 0 and sub == 0
                    w[R_gz * LANES + i] = GZ[k * NETWORKS * LANES + i] if own else 0.0
                pull(w, p, scale, gain)
                for i in range(n):
                    lam[i] += w[R_gx * LANES + i]
                    if s > 0:
                        grow[(s - 1) * n + i] += part * stages[s, 0] * w[R_gx * LANES + i]
        for i in range(n):
            G[k * n + i] += lam[i]


@jit
def collect(w, gp, gW):
    """Add gp and gw of the block to the gradients, and clear them."""
    for j in range(TRAINED):
        for i in range(LANES):
            gp[j] += w[(R_gp + j) * LANES + i]
            w[(R_gp + j) * LANES + i] = 0.0
    for j in range(WEIGHTS):
        gW[j] += w[R_gw * LANES + j]
        w[R_gw * LANES + j] = 0.0


@jit
def load_weights(w, W):
    for j in range(WEIGHTS):
        w[R_W * LANES + j] = W[j]


@jit
def load_constants(w, C, first, owner):
    for j in range(CONSTANTS):
        for i in range(LANES):
            w[(R_c + j) * LANES + i] = C[owner[first[i]], j]


@jit
def simulate(x0, start, owner, U, C, T, steps, substeps, h, hold, stages, p, W, scale, gain):
    """Trajectories (windows, steps + 1, STATES) and networks' efforts (windows, steps, NETWORKS)."""
    B = len(start)
    X = np.empty((B, steps + 1, STATES))
    Z = np.empty((B, steps, NETWORKS))
    w = np.zeros(ROWS * LANES)
    load_weights(w, W)
    xs = np.empty((steps + 1) * STATES * LANES)
    zs = np.empty(steps * NETWORKS * LANES)
    first = np.empty(LANES, np.int64)
    for block in range(0, B, LANES):
        for i in range(LANES):
            b = min(block + i, B - 1)
            first[i] = start[b]
            for j in range(STATES):
                xs[j * LANES + i] = x0[b, j]
        load_constants(w, C, first, owner)
        forward(w, xs, zs, first, steps, substeps, h, hold, stages, p, scale, gain, U, T)
        for i in range(min(LANES, B - block)):
            for k in range(steps + 1):
                for j in range(STATES):
                    X[block + i, k, j] = xs[(k * STATES + j) * LANES + i]
            for k in range(steps):
                for j in range(NETWORKS):
                    Z[block + i, k, j] = zs[(k * NETWORKS + j) * LANES + i]
    return X, Z


@jit
def pullback(X, GX, GZ, start, owner, U, C, T, steps, substeps, h, hold, stages, p, W, scale, gain):
    """Gradients by x0 (windows, STATES), trained parameters and weights, from those by X and Z of `simulate`."""
    B = len(start)
    gx0 = np.empty((B, STATES))
    gp = np.zeros(TRAINED)
    gW = np.zeros(WEIGHTS)
    w = np.zeros(ROWS * LANES)
    load_weights(w, W)
    xs = np.empty((steps + 1) * STATES * LANES)
    gs = np.empty((steps + 1) * STATES * LANES)
    gz = np.empty(steps * NETWORKS * LANES)
    first = np.empty(LANES, np.int64)
    for block in range(0, B, LANES):
        for i in range(LANES):
            b = min(block + i, B - 1)
            real = 1.0 if block + i < B else 0.0
            first[i] = start[b]
            for k in range(steps + 1):
                for j in range(STATES):
                    xs[(k * STATES + j) * LANES + i] = X[b, k, j]
                    gs[(k * STATES + j) * LANES + i] = real * GX[b, k, j]
            for k in range(steps):
                for j in range(NETWORKS):
                    gz[(k * NETWORKS + j) * LANES + i] = real * GZ[b, k, j]
        load_constants(w, C, first, owner)
        backward(w, xs, gs, gz, first, steps, substeps, h, hold, stages, p, scale, gain, U, T)
        collect(w, gp, gW)
        for i in range(min(LANES, B - block)):
            for j in range(STATES):
                gx0[block + i, j] = gs[j * LANES + i]
    return gx0, gp, gW


@jit
def batch_gradient(
    w,
    xs,
    gs,
    zs,
    first,
    starts,
    owner,
    Xd,
    U,
    C,
    T,
    steps,
    substeps,
    h,
    hold,
    stages,
    p,
    W,
    scale,
    gain,
    C_x,
    penalty,
    gp,
    gW,
):
    """Loss of eq. 4.9 over windows that start at the measured samples `starts`; gp and gW are overwritten.

    C_x (STATES,) is the diagonal of C; penalty (NETWORKS,) the price of a network's mean squared effort.
    """
    B = len(starts)
    load_weights(w, W)
    loss = 0.0
    gp[:] = 0.0
    gW[:] = 0.0
    share = 1.0 / (B * steps)
    for block in range(0, B, LANES):
        for i in range(LANES):
            first[i] = starts[min(block + i, B - 1)]
            for j in range(STATES):
                xs[j * LANES + i] = Xd[first[i], j]
        load_constants(w, C, first, owner)
        forward(w, xs, zs, first, steps, substeps, h, hold, stages, p, scale, gain, U, T)
        left = min(LANES, B - block)
        for j in range(STATES * LANES):
            gs[j] = 0.0
        for k in range(1, steps + 1):
            for j in range(STATES):
                for i in range(LANES):
                    a = (k * STATES + j) * LANES + i
                    r = xs[a] - Xd[first[i] + k, j]
                    gs[a] = 2.0 * C_x[j] * share * r if i < left else 0.0
                    loss += C_x[j] * share * r * r if i < left else 0.0
        for k in range(steps):
            for j in range(NETWORKS):
                for i in range(LANES):
                    a = (k * NETWORKS + j) * LANES + i
                    z = zs[a]
                    loss += penalty[j] * share * z * z if i < left else 0.0
                    zs[a] = 2.0 * penalty[j] * share * z if i < left else 0.0
        backward(w, xs, gs, zs, first, steps, substeps, h, hold, stages, p, scale, gain, U, T)
        collect(w, gp, gW)
    return loss


@jit
def adam(value, gradient, m, v, rate, count):
    """One step of Adam with its usual constants."""
    a = rate * math.sqrt(1.0 - 0.999**count) / (1.0 - 0.9**count)
    for j in range(len(value)):
        m[j] += 0.1 * (gradient[j] - m[j])
        v[j] += 0.001 * (gradient[j] * gradient[j] - v[j])
        value[j] -= a * m[j] / (math.sqrt(v[j]) + 1e-8)


@jit
def limit_norm(gp, gW, unit, clip):
    """Turn gp into the gradient by the scaled parameters, and shorten the whole gradient to the norm `clip`."""
    total = 0.0
    for j in range(TRAINED):
        gp[j] *= unit[j]
        total += gp[j] * gp[j]
    for j in range(WEIGHTS):
        total += gW[j] * gW[j]
    if total > clip * clip:
        share = clip / math.sqrt(total)
        for j in range(TRAINED):
            gp[j] *= share
        for j in range(WEIGHTS):
            gW[j] *= share


@jit
def train(
    starts,
    rates,
    physics_rates,
    count,
    clip,
    owner,
    Xd,
    U,
    C,
    T,
    steps,
    substeps,
    h,
    hold,
    stages,
    p,
    index,
    unit,
    low,
    high,
    W,
    scale,
    gain,
    C_x,
    penalty,
    xi,
    moments_p,
    moments_W,
):
    """Mini-batches one after the other: gradient, Adam on weights and scaled parameters, parameters kept in bounds.

    starts (batches, windows); rates, physics_rates (batches,); index, unit, low, high (TRAINED,): p[index] = unit * xi.
    p, W, xi (TRAINED,) and the moments (2, ...) are changed. Returns the loss of every batch; stops at one that is
    not finite.
    """
    w = np.zeros(ROWS * LANES)
    xs = np.empty((steps + 1) * STATES * LANES)
    gs = np.empty((steps + 1) * STATES * LANES)
    zs = np.empty(steps * NETWORKS * LANES)
    first = np.empty(LANES, np.int64)
    gp = np.empty(TRAINED)
    gW = np.empty(WEIGHTS)
    losses = np.full(len(starts), np.nan)
    for b in range(len(starts)):
        losses[b] = batch_gradient(
            w,
            xs,
            gs,
            zs,
            first,
            starts[b],
            owner,
            Xd,
            U,
            C,
            T,
            steps,
            substeps,
            h,
            hold,
            stages,
            p,
            W,
            scale,
            gain,
            C_x,
            penalty,
            gp,
            gW,
        )
        if not np.isfinite(losses[b]):
            break
        limit_norm(gp, gW, unit, clip)
        adam(W, gW, moments_W[0], moments_W[1], rates[b], count + b + 1)
        if TRAINED > 0:
            adam(xi, gp, moments_p[0], moments_p[1], physics_rates[b], count + b + 1)
            for j in range(TRAINED):
                xi[j] = min(max(xi[j], low[j] / unit[j]), high[j] / unit[j])
                p[index[j]] = unit[j] * xi[j]
    return losses
