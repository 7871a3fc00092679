"""Text of generated functions: loops over the lanes of a block, and steps of Runge and Kutta in them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from unmodelled.engine.cascade.cascade_loops import LANES

#: Of a step h, as `end` and `middle` use them.
FRACTIONS = ("half = h/2.0", "sixth = h/6.0", "part = h/24.0")


def cells(first: int, n: int, array: str = "w") -> list[str]:
    """Return the code of the numbers of some rows in lane i."""
    return [f"{array}[{(first + k) * LANES} + i]" for k in range(n)]


def load(letter: str, first: int, n: int, array: str = "w") -> list[str]:
    """Return assignments of rows to variables `letter`0, `letter`1, ..."""
    return [f"{letter}{k} = {cell}" for k, cell in enumerate(cells(first, n, array))]


def over_lanes(lines: Iterable[str]) -> list[str]:
    """Return a loop over the lanes."""
    return ["for i in range(LANES):", *indented(lines)]


def indented(lines: Iterable[str]) -> list[str]:
    """Return the body of a loop or function."""
    return [f"    {line}" for line in (*lines, "pass")]


def function(signature: str, head: str, lines: Iterable[str]) -> str:
    """Return a compiled function."""
    return "\n".join([f"@jit({signature})", f"def {head}:", *indented(lines)]) + "\n"


def stages(
    letter: str, states: Sequence[str], rates: Callable[[int], list[str]], slots: Sequence[list[str]]
) -> list[str]:
    """Return the stages of a step of Runge and Kutta."""
    n = range(len(states))
    lines = [f"{letter}{k} = y{k} = {cell}" for k, cell in enumerate(states)]
    for stage, slot in enumerate((0, 1, 1, 2)):
        lines += [*slots[slot], *rates(stage)]
        if stage < 3:
            factor = "h" if stage == 2 else "half"
            lines += [f"{letter}{k} = y{k} + {factor}*k{stage}_{k}" for k in n]
    return lines


def end(k: int) -> str:
    """Return the code of a state at the end of a step."""
    return f"y{k} + sixth*(k0_{k} + 2.0*(k1_{k} + k2_{k}) + k3_{k})"


def middle(k: int) -> str:
    """Return the code of a state in the middle of a step, to third order, from the same stages."""
    return f"y{k} + part*(5.0*k0_{k} + 4.0*(k1_{k} + k2_{k}) - k3_{k})"
