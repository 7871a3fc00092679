"""Compiled elimination of start states, and least squares of subsets of columns with left-out errors."""

# mypy: ignore-errors

import numpy as np

from unmodelled.engine.compiled.layout import jit

#: Most amplitudes of a subset.
MOST = 24
#: Smallest pivot of an elimination.
LEAST_PIVOT = 1e-12


@jit()
def solve(fit, index, size, positive, found):
    """Write amplitudes of some columns to `found` (most,); one that would be negative but cannot is left out.

    Of the numbers `index` the first `size` count; `fit` and `positive` as in `Folds`.
    """
    last = fit.shape[0] - 1
    on = np.ones(size, np.bool_)
    L, z = np.empty((size, size)), np.empty(size)
    for _ in range(size + 1):
        for i in range(size):
            if not on[i]:
                continue
            total = fit[index[i], last]
            for j in range(i + 1):
                if not on[j]:
                    continue
                value = fit[index[i], index[j]]
                for k in range(j):
                    if on[k]:
                        value -= L[i, k] * L[j, k]
                L[i, j] = np.sqrt(max(value, LEAST_PIVOT)) if i == j else value / L[j, j]
                if j < i:
                    total -= L[i, j] * z[j]
            z[i] = total / L[i, i]
        for i in range(size - 1, -1, -1):
            found[i] = 0.0
            if on[i]:
                total = z[i]
                for k in range(i + 1, size):
                    if on[k]:
                        total -= L[k, i] * found[k]
                found[i] = total / L[i, i]
        wrong = False
        for i in range(size):
            if on[i] and positive[index[i]] and found[i] < 0.0:
                on[i], wrong = False, True
        if not wrong:
            return


@jit()
def left_out(fit, score, sets, first, count, positive):
    """Return squared errors (sets, folds) of left-out experiments, with the fields of `Folds`.

    Sets (sets, most) are numbers of atoms, -1 where a set has fewer.
    """
    folds, last = fit.shape[0], fit.shape[1] - 1
    out = np.empty((len(sets), folds))
    index, found = np.empty(MOST, np.int64), np.empty(MOST)
    for s in range(len(sets)):
        size = 0
        for a in sets[s]:
            if a >= 0:
                for k in range(count[a]):
                    if size < MOST:
                        index[size] = first[a] + k
                        size += 1
        for f in range(folds):
            solve(fit[f], index, size, positive, found)
            total = score[f, last, last]
            for i in range(size):
                row = -2.0 * score[f, index[i], last]
                for j in range(size):
                    row += score[f, index[i], index[j]] * found[j]
                total += row * found[i]
            out[s, f] = total
    return out


@jit()
def without_starts(columns, root, S, inverse):
    """Return columns (windows, K * outputs + states, N) whose products are those without the start states.

    They come from changes of the window errors (windows, K, outputs, N) and roots of their weights, weighted
    columns `S` (windows, K * outputs, states) of the states, and the inverse of their products with a prior.
    """
    W, K, J, N = columns.shape
    n, rows = S.shape[2], K * J
    found = np.empty((W, rows + n, N))
    cross = np.empty((n, N))
    for w in range(W):
        cross[:] = 0.0
        for k in range(K):
            for j in range(J):
                r = k * J + j
                for c in range(N):
                    found[w, r, c] = root[w, k, j] * columns[w, k, j, c]
                for i in range(n):
                    by = S[w, r, i]
                    for c in range(N):
                        cross[i, c] += by * found[w, r, c]
        for i in range(n):
            for c in range(N):
                found[w, rows + i, c] = 0.0
            for m in range(n):
                by = inverse[w, i, m]
                for c in range(N):
                    found[w, rows + i, c] -= by * cross[m, c]
        for r in range(rows):
            for i in range(n):
                by = S[w, r, i]
                for c in range(N):
                    found[w, r, c] += by * found[w, rows + i, c]
    return found
