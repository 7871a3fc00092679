"""Products of small matrices for compiled loops, in tiles that stay in registers.

A recurrent network of 32 units multiplies matrices of 32 by 32 numbers at every time step. For such small
matrices, the call of a library costs as much as its work, and a plain loop is not vectorised. A tile is
therefore written as LLVM vectors, which become vector instructions of the processor.
"""

from typing import Any

from llvmlite import binding, ir  # type: ignore[import-untyped]
from numba.core import cgutils, types
from numba.extending import intrinsic

from unmodelled.base.compiling import compiled

#: A tile's rows and numbers per row, as many as the registers hold, and where the matrix ends before.
ROWS, LANES = (8, 32) if binding.get_host_cpu_features().get("avx512f") else (4, 16)
LEAST = 4


def _tile(rows: int, lanes: int) -> Any:
    """out[o + r * pitch + l] += sum over k of a[i + r * row + k * step] * b[j + k * width + l]."""

    def tile(
        context: Any,
        out: Any,
        o: Any,
        pitch: Any,
        a: Any,
        i: Any,
        row: Any,
        step: Any,
        b: Any,
        j: Any,
        width: Any,
        depth: Any,
    ) -> Any:
        signature = types.void(out, o, pitch, a, i, row, step, b, j, width, depth)
        return signature, _generator(rows, lanes)

    return intrinsic(tile)


def _generator(rows: int, lanes: int) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kinds = signature.args
        out, a, b = (context.make_array(kinds[k])(context, builder, arguments[k]).data for k in (0, 3, 7))
        o, pitch, i, row, step, j, width, depth = (arguments[k] for k in (1, 2, 4, 5, 6, 8, 9, 10))
        number = context.get_data_type(kinds[0].dtype)
        vector, size = ir.VectorType(number, lanes), context.get_abi_sizeof(number)

        def at(array: Any, first: Any, pitch: Any, k: Any) -> Any:
            return builder.gep(array, [builder.add(first, builder.mul(pitch, k))])

        def vector_at(array: Any, first: Any, pitch: Any, k: Any) -> Any:
            return builder.bitcast(at(array, first, pitch, k), vector.as_pointer())

        targets = [vector_at(out, o, pitch, o.type(r)) for r in range(rows)]
        sums = [cgutils.alloca_once_value(builder, builder.load(t, align=size)) for t in targets]
        with cgutils.for_range(builder, depth) as loop:
            right = builder.load(vector_at(b, j, width, loop.index), align=size)
            for r, total in enumerate(sums):
                left = builder.load(at(a, builder.add(i, builder.mul(row, i.type(r))), step, loop.index))
                product = builder.fmul(_repeated(builder, left, vector), right, flags=("contract",))
                builder.store(builder.fadd(builder.load(total), product, flags=("contract",)), total)
        for target, total in zip(targets, sums, strict=True):
            builder.store(builder.load(total), target, align=size)
        return context.get_dummy_value()

    return generate


def _repeated(builder: Any, number: Any, vector: Any) -> Any:
    """A vector whose elements are all `number`."""
    index, undefined = ir.IntType(32), ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(undefined, number, index(0))
    return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(index, vector.count), None))


_large, _flat, _small = _tile(ROWS, LANES), _tile(LEAST, LANES), _tile(LEAST, LEAST)


@compiled
def add_product(
    out: Any, o: int, a: Any, i: int, row: int, step: int, b: Any, j: int, n: int, depth: int, width: int
) -> None:
    """Add the product A B of two matrices in flat arrays to a third: out += A B.

    Element (r, k) of A is at i + r * row + k * step, so that A may be stored transposed; out and B are stored
    row by row. `row` and `step` should not be constants at compile time, because loading neighbours as one
    vector and splitting it is slower.

    Takes a (n, depth), b (depth, width).
    """
    wide = width - width % LANES
    for first in range(0, wide, LANES):
        r = 0
        while r + ROWS <= n:
            _large(out, o + r * width + first, width, a, i + r * row, row, step, b, j + first, width, depth)
            r += ROWS
        while r < n:
            _flat(out, o + r * width + first, width, a, i + r * row, row, step, b, j + first, width, depth)
            r += LEAST
    for first in range(wide, width, LEAST):
        for r in range(0, n, LEAST):
            _small(out, o + r * width + first, width, a, i + r * row, row, step, b, j + first, width, depth)
