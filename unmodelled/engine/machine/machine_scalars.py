"""Exponential functions of one number without branches, so that loops over lanes run in vector registers."""

# mypy: ignore-errors

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from unmodelled.engine.compiled.layout import jit

#: Beyond these an exponential overflows, or is zero.
HIGHEST, LOWEST = 709.782712893384, -745.2
#: From here on a hyperbolic tangent is one.
ONE_FROM = 20.0


@intrinsic
def from_bits(context, bits):
    """The floating-point number with these 64 bits."""

    def generate(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.DoubleType())

    return types.float64(types.int64), generate


@jit()
def two_to(k):
    """2**k for a whole number k within the exponents of normal numbers."""
    return from_bits((np.int64(k) + 1023) << 52)


@jit()
def power_of_e(x, k):
    """e**x over 2**k, the nearest power of two (rational function of Cephes)."""
    r = (x - k * 6.93145751953125e-1) - k * 1.42860682030941723212e-6
    z = r * r
    p = 1.26177193074810590878e-4
    p = p * z + 3.02994407707441961300e-2
    p = r * (p * z + 9.99999999999999999910e-1)
    q = 3.00198505138664455042e-6
    q = q * z + 2.52448340349684104192e-3
    q = q * z + 2.27265548208155028766e-1
    q = q * z + 2.00000000000000000009e0
    return 1.0 + 2.0 * p / (q - p)


@jit()
def exp(x):
    """e**x to the last digits."""
    held = HIGHEST if x > HIGHEST else (LOWEST if x < LOWEST else x)
    k = np.floor(held * 1.4426950408889634 + 0.5)
    # in two factors: the result may be below the smallest normal number
    half = np.floor(0.5 * k)
    value = power_of_e(held, k) * two_to(half) * two_to(k - half)
    return np.inf if x > HIGHEST else value


@jit()
def tanh(x):
    """Hyperbolic tangent to the last digits (rational function of Cephes near zero)."""
    size = abs(x)
    double = 2.0 * size if size < ONE_FROM else 2.0 * ONE_FROM
    k = np.floor(double * 1.4426950408889634 + 0.5)
    far = 1.0 - 2.0 / (power_of_e(double, k) * two_to(k) + 1.0)
    z = x * x
    p = -9.64399179425052238628e-1
    p = p * z - 9.92877231001918586564e1
    p = p * z - 1.61468768441708447952e3
    q = z + 1.12811678491632931402e2
    q = q * z + 2.23548839060100448583e3
    q = q * z + 4.84406305325125486048e3
    near = x + x * z * p / q
    return near if not size >= 0.625 else np.copysign(far, x)
