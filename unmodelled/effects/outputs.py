"""What an output of a system shows beside others: the rate of another output, or an input at once."""

from __future__ import annotations

import sympy as sp

from unmodelled.systems.model import Input, Output, System, symbol


def rate_output(system: System, name: str) -> Output | None:
    """Return the output that shows the rate of the named one, as the speed of an encoder; or None."""
    rates = dict(zip(system.x, system.dynamics, strict=True))
    (expression,) = (o.expression for o in system.outputs if o.name == name)
    moving = expression.free_symbols & rates.keys()
    if not moving or not all(rates[x] in rates for x in moving):
        return None
    rate = sum((sp.diff(expression, x) * rates[x] for x in moving), sp.S.Zero)
    return next((o for o in system.outputs if o.expression == rate), None)


def direct_input(system: System, output: Output) -> Input | None:
    """Return the only input that acts on an output at once, without a state between; or None."""
    acting = [item for item in system.inputs if output.expression.has(symbol(item.name))]
    return acting[0] if len(acting) == 1 else None
