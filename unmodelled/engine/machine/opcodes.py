"""The instructions of the register machine."""

from __future__ import annotations

from enum import IntEnum

#: Lanes of a register: free runs side by side.
LANES = 256


class Op(IntEnum):
    """Result that an instruction writes to its destination, lane by lane, from the registers a, b and c."""

    ADD = 0  # a + b
    SUB = 1  # a - b
    MUL = 2  # a*b
    DIV = 3  # a/b
    MULADD = 4  # a*b + c
    MULSUB = 5  # a*b - c
    NEGMULADD = 6  # c - a*b
    NEG = 7
    SQRT = 8
    SIN = 9
    COS = 10
    EXP = 11
    TANH = 12
    ABS = 13
    SGN = 14
    STEP = 15
    MIN = 16
    MAX = 17
    FLOOR = 18
    GREATER = 19
    AT_LEAST = 20
    EQUAL = 21
    SELECT = 22  # b where a is not zero, else c
    LOOKUP = 23  # table number c at a
    POW = 24
    LOG = 25
    ASIN = 26
    ACOS = 27
    ATAN = 28
    ATAN2 = 29
    SINH = 30
    COSH = 31
