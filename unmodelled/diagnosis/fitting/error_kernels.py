"""Compiled loops over all simulated samples: errors, their differences, delayed values."""

# mypy: ignore-errors

import numpy as np

from unmodelled.engine.compiled.layout import jit


@jit()
def cut_errors(y, measured, noise, largest, steps):
    """Return errors, shape (windows, sets, samples, outputs), in units of the noise, cut at a largest size.

    Nan in `y` counts as the `largest` error (outputs,); after the `steps` (windows,) they are zero.
    """
    r = np.zeros_like(y)
    for w in range(y.shape[0]):
        for s in range(y.shape[1]):
            like = s if measured.shape[1] > 1 else 0
            for k in range(steps[w]):
                for j in range(y.shape[3]):
                    error = (y[w, s, k, j] - measured[w, like, k, j]) / noise[j]
                    size = abs(error) if abs(error) <= largest[j] else largest[j]
                    r[w, s, k, j] = -size if error < 0.0 else size
    return r


@jit()
def forward_differences(r, largest, steps):
    """Return derivatives, shape (windows, sets - 1, samples, outputs), of errors by forward differences.

    The first set of the errors `r` is the point. Derivatives of errors that were cut are zero.
    """
    found = np.empty((r.shape[0], r.shape[1] - 1, r.shape[2], r.shape[3]))
    for w in range(r.shape[0]):
        for s in range(r.shape[1] - 1):
            factor = 1.0 / steps[w, s]
            for k in range(r.shape[2]):
                for j in range(r.shape[3]):
                    a, b = r[w, 0, k, j], r[w, s + 1, k, j]
                    inside = abs(a) < largest[j] and abs(b) < largest[j]
                    found[w, s, k, j] = factor * (b - a) if inside else 0.0
    return found


@jit()
def fill_weights(weight, count, at):
    """Write the weights of the polynomial through `count` neighbours, at 0, 1, ..., for its value at `at`."""
    for a in range(count):
        weight[a] = 1.0
        for b in range(count):
            if b != a:
                weight[a] *= (at - b) / (a - b)


@jit()
def delayed_values(y, late, steps):
    """Return the values of y a fraction of a sample earlier, by the cubic through four neighbours.

    They are of shape (windows, sets, samples - 1, outputs), from the second sample of a window on. Delays
    `late` (sets, outputs) are in samples.
    """
    found = np.full((y.shape[0], y.shape[1], y.shape[2] - 1, y.shape[3]), np.nan)
    weight = np.empty(4)
    for s in range(y.shape[1]):
        for j in range(y.shape[3]):
            # relative to the first of the four neighbours, which moves along except near the ends
            whole = int(np.floor(-late[s, j])) - 1
            fill_weights(weight, 4, -late[s, j] - whole)
            for w in range(y.shape[0]):
                last = steps[w]
                for k in range(1, last + 1):
                    first = k + whole
                    if 0 <= first <= last - 3:
                        value = weight[0] * y[w, s, first, j] + weight[1] * y[w, s, first + 1, j]
                        value += weight[2] * y[w, s, first + 2, j] + weight[3] * y[w, s, first + 3, j]
                    else:
                        first = max(0, min(first, last - 3))
                        count = min(4, last + 1 - first)
                        near = np.empty(4)
                        fill_weights(near, count, k - late[s, j] - first)
                        value = 0.0
                        for a in range(count):
                            value += near[a] * y[w, s, first + a, j]
                    found[w, s, k - 1, j] = value
    return found
