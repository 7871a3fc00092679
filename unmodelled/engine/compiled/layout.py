"""Layout of the values in a block, shared by the generated physics and the loops that run it."""

# mypy: ignore-errors

import functools
import threading
from typing import NamedTuple

from numba import types

from unmodelled.base.compiling import kept

#: Samples side by side in a block.
LANES = 16

#: Of functions whose sums may be taken in any order, and of all others.
SUMS = {"contract", "nsz", "reassoc"}
EXACT = {"contract", "nsz"}

Array = types.float64[::1]
#: Generated functions of a block and the parameters.
Block = types.FunctionType(types.void(Array, Array))


class Layout(NamedTuple):
    """First rows of a block's parts, the number of its rows, and the sizes of the system.

    x state, u input, c operating point, t time, h integration step, z networks' efforts, dx derivative, lam
    adjoint of dx, gx and gz adjoints of x and z, gp and gw gradients by parameters and weights, weights,
    scale, gain of the networks.
    """

    x: int
    u: int
    c: int
    t: int
    h: int
    z: int
    dx: int
    lam: int
    gx: int
    gz: int
    gp: int
    gw: int
    weights: int
    scale: int
    gain: int
    rows: int
    states: int
    inputs: int
    constants: int
    networks: int
    trained: int
    size: int


_COMPILING = threading.Lock()
LayoutType = types.NamedUniTuple(types.int64, len(Layout._fields), Layout)


def jit(*signature, sums=False):
    """Compile a function; with a signature at once, so that functions can be passed as arguments.

    With `sums`, sums may be taken in any order.
    """
    return kept(*signature, error_model="numpy", fastmath=SUMS if sums else EXACT, nogil=True)


def entry(signature):
    """Compile a function at its first call for a signature, which lets functions be passed as arguments."""

    def decorate(function):
        compiled = jit()(function)

        @functools.wraps(function)
        def call(*arguments):
            with _COMPILING:
                if not compiled.signatures:
                    compiled.compile(signature)
                    compiled.disable_compile()  # or it would be compiled again for every function it is given
            return compiled(*arguments)

        return call

    return decorate
