"""Functions of one number that generated code calls: compiled, without branches where vector registers want
none.
"""

# mypy: ignore-errors

import numpy as np

from unmodelled.engine.compiled.layout import jit


@jit()
def sine(r):
    """Return the sine of an angle within an eighth of a turn (polynomial of Cephes)."""
    z = r * r
    p = 1.58962301576546568060e-10
    p = p * z - 2.50507477628578072866e-8
    p = p * z + 2.75573136213857245213e-6
    p = p * z - 1.98412698295895385996e-4
    p = p * z + 8.33333333332211858878e-3
    p = p * z - 1.66666666666666307295e-1
    return r + r * z * p


@jit()
def cosine(r):
    """Return the cosine of an angle within an eighth of a turn (polynomial of Cephes)."""
    z = r * r
    p = -1.13585365213876817300e-11
    p = p * z + 2.08757008419747316778e-9
    p = p * z - 2.75573141792967388112e-7
    p = p * z + 2.48015872888517045348e-5
    p = p * z - 1.38888888888730564116e-3
    p = p * z + 4.16666666666665929218e-2
    return 1.0 - 0.5 * z + z * z * p


@jit()
def quarters(x):
    """Return the nearest whole number of quarter turns of an angle x, rad."""
    return np.floor(x * 0.6366197723675814 + 0.5)


@jit()
def rest(x, k):
    """Return x less k quarter turns, given in three parts (Cody and Waite), so that no digit is lost."""
    return ((x - k * 1.5707963267341256) - k * 6.077100506303966e-11) - k * 2.0222662487959506e-21


@jit()
def sin(x):
    """Return the sine without branches; exact to the last digits within thousands of turns."""
    k = quarters(x)
    r = rest(x, k)
    quarter = k - 4.0 * np.floor(k * 0.25)
    value = cosine(r) if (quarter == 1.0 or quarter == 3.0) else sine(r)
    return -value if quarter >= 2.0 else value


@jit()
def cos(x):
    """Return the cosine without branches, see `sin`."""
    k = quarters(x)
    r = rest(x, k)
    quarter = k - 4.0 * np.floor(k * 0.25)
    value = sine(r) if (quarter == 1.0 or quarter == 3.0) else cosine(r)
    return -value if (quarter == 1.0 or quarter == 2.0) else value


@jit()
def sgn(x):
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@jit()
def step(x):
    return 1.0 if x > 0.0 else (0.0 if x < 0.0 else 0.5)


@jit()
def whole(x):
    return np.floor(x)


@jit()
def greater(a, b):
    return 1.0 if a > b else 0.0


@jit()
def at_least(a, b):
    return 1.0 if a >= b else 0.0


@jit()
def equal(a, b):
    return 1.0 if a == b else 0.0


@jit()
def absolute(x):
    return abs(x)


@jit()
def minimum(a, b):
    return a if a < b or a != a else b


@jit()
def maximum(a, b):
    return a if a > b or a != a else b


@jit()
def select(condition, a, b):
    return a if condition != 0.0 else b


@jit()
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
