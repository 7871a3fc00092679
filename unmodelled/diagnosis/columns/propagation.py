"""Compiled propagation of small changes along a free run: dx' = A dx + B r, dy = C dx + D r."""

# mypy: ignore-errors

import numpy as np

from unmodelled.engine.compiled.layout import jit

#: Order of the Taylor series of a matrix exponential, and size of its argument above which it is halved.
ORDER, LARGEST = 6, 0.5


@jit()
def exponential(A, h, out, term, work):
    """Write the exponential of A*h to `out`: a Taylor series, scaled and squared."""
    n = A.shape[0]
    size, halvings = 0.0, 0
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(A[i, j]) * h
        size = max(size, row)
    while size > LARGEST and halvings < 20:
        size *= 0.5
        halvings += 1
    h = h / 2.0**halvings
    for i in range(n):
        for j in range(n):
            term[i, j] = out[i, j] = 1.0 if i == j else 0.0
    for order in range(1, ORDER + 1):
        multiply(term, A, work)
        for i in range(n):
            for j in range(n):
                term[i, j] = work[i, j] * h / order
                out[i, j] += term[i, j]
    for _ in range(halvings):
        multiply(out, out, work)
        for i in range(n):
            for j in range(n):
                out[i, j] = work[i, j]


@jit()
def multiply(a, b, out):
    """Write the product of two square matrices to `out`."""
    n = a.shape[0]
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += a[i, k] * b[k, j]
            out[i, j] = total


@jit()
def transitions(A, period):
    """Return transitions (windows, K, n, n) of samples and their second halves, from A on the half grid."""
    W, H, n, _ = A.shape
    K = (H - 1) // 2
    whole, second = np.empty((W, K, n, n)), np.empty((W, K, n, n))
    middle, first = np.empty((n, n)), np.empty((n, n))
    term, work = np.empty((n, n)), np.empty((n, n))
    for w in range(W):
        for k in range(K):
            for half in range(2):
                for i in range(n):
                    for j in range(n):
                        middle[i, j] = 0.5 * (A[w, 2 * k + half, i, j] + A[w, 2 * k + half + 1, i, j])
                exponential(middle, 0.5 * period, first if half == 0 else second[w, k], term, work)
            multiply(second[w, k], first, whole[w, k])
    return whole, second


@jit()
def propagate(whole, second, B, C, D, forcing, start, steps, judged, order, chained, hidden, period):
    """Return changes of the outputs, shape (judged windows, K, outputs, columns), by forcings along the path.

    Measured states start anew in every window. Hidden ones are integrated along the experiment with the
    measured states imposed, as a free run does, and so is their change.

    - whole, second: transitions of a sample and of its second half, (windows, K, n, n).
    - B (windows, 2 K + 1, n), D (windows, K + 1, outputs): derivatives of rates, outputs by what is forced.
    - C: derivatives of the outputs by the states, (windows, K + 1, outputs, n).
    - forcing: addition to what is forced, (windows, 2 K + 1, columns).
    - start: change of the initial states, (windows, n, columns); of hidden ones where a chain begins.
    - order, chained, hidden: see `Path.chain`; period in s.
    """
    K, n = whole.shape[1:3]
    J, N = C.shape[2], forcing.shape[2]
    place = np.cumsum(judged) - 1
    out = np.zeros((np.sum(judged), K, J, N))
    d, e, f = np.zeros((n, N)), np.zeros((n, N)), np.zeros((n, N))
    h, g = np.zeros((n, N)), np.zeros((n, N))
    for w in order:
        for i in range(n):
            for c in range(N):
                if not chained[w]:
                    h[i, c] = start[w, i, c]
                d[i, c] = h[i, c] if hidden[i] else start[w, i, c]
                if not hidden[i]:
                    h[i, c] = 0.0
        for k in range(steps[w]):
            for i in range(n):
                at_start, at_middle = 0.0, 0.0
                for j in range(n):
                    at_start += whole[w, k, i, j] * B[w, 2 * k, j]
                    at_middle += second[w, k, i, j] * B[w, 2 * k + 1, j]
                at_start, at_middle = period / 6.0 * at_start, 4.0 * period / 6.0 * at_middle
                at_end = period / 6.0 * B[w, 2 * k + 2, i]
                for c in range(N):
                    f[i, c] = e[i, c] = (
                        at_start * forcing[w, 2 * k, c]
                        + at_middle * forcing[w, 2 * k + 1, c]
                        + at_end * forcing[w, 2 * k + 2, c]
                    )
                for j in range(n):
                    by = whole[w, k, i, j]
                    if by != 0.0:
                        for c in range(N):
                            e[i, c] += by * d[j, c]
                if hidden[i]:
                    for c in range(N):
                        g[i, c] = f[i, c]
                    for j in range(n):
                        if hidden[j]:
                            for c in range(N):
                                g[i, c] += whole[w, k, i, j] * h[j, c]
            d, e = e, d
            h, g = g, h
            for o in range(J if judged[w] else 0):
                by = D[w, k + 1, o]
                if by != 0.0:
                    for c in range(N):
                        out[place[w], k, o, c] = by * forcing[w, 2 * k + 2, c]
                for j in range(n):
                    by = C[w, k + 1, o, j]
                    if by != 0.0:
                        for c in range(N):
                            out[place[w], k, o, c] += by * d[j, c]
    return out
