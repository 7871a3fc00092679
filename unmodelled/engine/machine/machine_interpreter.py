"""Runs instructions of the register machine on its lanes."""

# mypy: ignore-errors

import math

import numpy as np

from unmodelled.engine.compiled.layout import jit
from unmodelled.engine.compiled.scalars import (
    at_least,
    cos,
    equal,
    greater,
    maximum,
    minimum,
    select,
    sgn,
    sin,
    step,
)
from unmodelled.engine.machine.machine_opcodes import Op
from unmodelled.engine.machine.machine_scalars import exp, tanh


@jit()
def looked_up(x, k, curves):
    """Table `k` at `x`."""
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
                w[d, i] = sin(w[a, i])
        elif op == Op.COS:
            for i in range(lanes):
                w[d, i] = cos(w[a, i])
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
                w[d, i] = sgn(w[a, i])
        elif op == Op.STEP:
            for i in range(lanes):
                w[d, i] = step(w[a, i])
        elif op == Op.MIN:
            for i in range(lanes):
                w[d, i] = minimum(w[a, i], w[b, i])
        elif op == Op.MAX:
            for i in range(lanes):
                w[d, i] = maximum(w[a, i], w[b, i])
        elif op == Op.FLOOR:
            for i in range(lanes):
                w[d, i] = np.floor(w[a, i])
        elif op == Op.GREATER:
            for i in range(lanes):
                w[d, i] = greater(w[a, i], w[b, i])
        elif op == Op.AT_LEAST:
            for i in range(lanes):
                w[d, i] = at_least(w[a, i], w[b, i])
        elif op == Op.EQUAL:
            for i in range(lanes):
                w[d, i] = equal(w[a, i], w[b, i])
        elif op == Op.SELECT:
            for i in range(lanes):
                w[d, i] = select(w[a, i], w[b, i], w[c, i])
        elif op == Op.LOOKUP:
            for i in range(lanes):
                w[d, i] = looked_up(w[a, i], code[k, 5], curves)
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
