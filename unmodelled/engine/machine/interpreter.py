"""Run instructions of the register machine on its lanes.

The exponential functions of one number have no branches, so that loops over lanes run in vector registers.
"""

# mypy: ignore-errors

import math

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from unmodelled.engine.compiled import scalars
from unmodelled.engine.compiled.layout import jit
from unmodelled.engine.machine.opcodes import Op

#: Beyond these an exponential overflows, or is zero.
HIGHEST, LOWEST = 709.782712893384, -745.2
#: From here on a hyperbolic tangent is one.
ONE_FROM = 20.0


@intrinsic
def from_bits(context, bits):
    """Return the floating-point number with the given 64 bits."""

    def generate(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.DoubleType())

    return types.float64(types.int64), generate


@jit()
def two_to(k):
    """Return 2**k for a whole number k within the exponents of normal numbers."""
    return from_bits((np.int64(k) + 1023) << 52)


@jit()
def power_of_e(x, k):
    """Return e**x over 2**k, the nearest power of two (rational function of Cephes)."""
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
    """Return e**x to the last digits."""
    held = HIGHEST if x > HIGHEST else (LOWEST if x < LOWEST else x)
    k = np.floor(held * 1.4426950408889634 + 0.5)
    # in two factors: the result may be below the smallest normal number
    half = np.floor(0.5 * k)
    value = power_of_e(held, k) * two_to(half) * two_to(k - half)
    return np.inf if x > HIGHEST else value


@jit()
def tanh(x):
    """Return the hyperbolic tangent to the last digits (rational function of Cephes near zero)."""
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


@jit()
def looked_up(x, k, curves):
    """Return the value of table `k` at `x`."""
    first, last = curves.spans[k, 0], curves.spans[k, 1]
    if not x > curves.knots[first]:
        return curves.ends[k, 0] if x <= curves.knots[first] else x
    if x >= curves.knots[last]:
        return curves.ends[k, 1]
    while last - first > 1:
        middle = (first + last) // 2
        if curves.knots[middle] <= x:
            first = middle
        else:
            last = middle
    d, c = x - curves.knots[first], curves.pieces
    return ((c[first, 0] * d + c[first, 1]) * d + c[first, 2]) * d + c[first, 3]


@jit()
def tanh_of(w, d, a, lanes):
    # on its own, or it would be too long to be inlined, and not vectorised
    for i in range(lanes):
        w[d, i] = tanh(w[a, i])


@jit()
def execute_rare(w, lanes, op, d, a, b, c, table, curves):
    """Run one instruction of those that are rare, on the first lanes of the registers w (rows, lanes)."""
    if op == Op.FLOOR:
        for i in range(lanes):
            w[d, i] = np.floor(w[a, i])
    elif op == Op.GREATER:
        for i in range(lanes):
            w[d, i] = scalars.greater(w[a, i], w[b, i])
    elif op == Op.AT_LEAST:
        for i in range(lanes):
            w[d, i] = scalars.at_least(w[a, i], w[b, i])
    elif op == Op.EQUAL:
        for i in range(lanes):
            w[d, i] = scalars.equal(w[a, i], w[b, i])
    elif op == Op.SELECT:
        for i in range(lanes):
            w[d, i] = scalars.select(w[a, i], w[b, i], w[c, i])
    elif op == Op.LOOKUP:
        for i in range(lanes):
            w[d, i] = looked_up(w[a, i], table, curves)
    elif op == Op.POW:
        for i in range(lanes):
            w[d, i] = math.pow(w[a, i], w[b, i])
    elif op == Op.LOG:
        for i in range(lanes):
            w[d, i] = math.log(w[a, i])
    elif op == Op.ASIN:
        for i in range(lanes):
            w[d, i] = math.asin(w[a, i])
    elif op == Op.ACOS:
        for i in range(lanes):
            w[d, i] = math.acos(w[a, i])
    elif op == Op.ATAN:
        for i in range(lanes):
            w[d, i] = math.atan(w[a, i])
    elif op == Op.ATAN2:
        for i in range(lanes):
            w[d, i] = math.atan2(w[a, i], w[b, i])
    elif op == Op.SINH:
        for i in range(lanes):
            w[d, i] = math.sinh(w[a, i])
    elif op == Op.COSH:
        for i in range(lanes):
            w[d, i] = math.cosh(w[a, i])


@jit()
def execute(w, lanes, code, first, last, curves):
    """Run the instructions `first` to `last` of `code` on the first `lanes` of the registers `w`."""
    for k in range(first, last):
        op, d, a, b, c = code[k, 0], code[k, 1], code[k, 2], code[k, 3], code[k, 4]
        if op == Op.ADD:
            for i in range(lanes):
                w[d, i] = w[a, i] + w[b, i]
        elif op == Op.SUB:
            for i in range(lanes):
                w[d, i] = w[a, i] - w[b, i]
        elif op == Op.MUL:
            for i in range(lanes):
                w[d, i] = w[a, i] * w[b, i]
        elif op == Op.DIV:
            for i in range(lanes):
                w[d, i] = w[a, i] / w[b, i]
        elif op == Op.MULADD:
            for i in range(lanes):
                w[d, i] = w[a, i] * w[b, i] + w[c, i]
        elif op == Op.MULSUB:
            for i in range(lanes):
                w[d, i] = w[a, i] * w[b, i] - w[c, i]
        elif op == Op.NEGMULADD:
            for i in range(lanes):
                w[d, i] = w[c, i] - w[a, i] * w[b, i]
        elif op == Op.NEG:
            for i in range(lanes):
                w[d, i] = -w[a, i]
        elif op == Op.SQRT:
            for i in range(lanes):
                w[d, i] = math.sqrt(w[a, i])
        elif op == Op.SIN:
            for i in range(lanes):
                w[d, i] = scalars.sin(w[a, i])
        elif op == Op.COS:
            for i in range(lanes):
                w[d, i] = scalars.cos(w[a, i])
        elif op == Op.EXP:
            for i in range(lanes):
                w[d, i] = exp(w[a, i])
        elif op == Op.TANH:
            tanh_of(w, d, a, lanes)
        elif op == Op.ABS:
            for i in range(lanes):
                w[d, i] = abs(w[a, i])
        elif op == Op.SGN:
            for i in range(lanes):
                w[d, i] = scalars.sgn(w[a, i])
        elif op == Op.STEP:
            for i in range(lanes):
                w[d, i] = scalars.step(w[a, i])
        elif op == Op.MIN:
            for i in range(lanes):
                w[d, i] = scalars.minimum(w[a, i], w[b, i])
        elif op == Op.MAX:
            for i in range(lanes):
                w[d, i] = scalars.maximum(w[a, i], w[b, i])
        else:
            execute_rare(w, lanes, op, d, a, b, c, code[k, 5], curves)
