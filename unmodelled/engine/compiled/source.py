"""The generated part of a kernel: physics and networks of one structure, on blocks of samples side by side.

A block holds `LANES` samples. Everything a block works on lies in one flat array of rows, `LANES` numbers
each, at addresses that are literals in the code: LLVM then knows that nothing overlaps and runs the lanes in
vector registers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from unmodelled.engine.compiled.layout import LANES, Layout
from unmodelled.engine.compiled.printer import assignments
from unmodelled.engine.compiled.structure import Augmented, Network
from unmodelled.systems.functions import gradient
from unmodelled.systems.model import TIME, System
from unmodelled.systems.sticking import STEP_LENGTH, held


@dataclass(frozen=True)
class Rows:
    """First rows of the parts of a block by name, and the number of all rows."""

    first: Mapping[str, int]
    count: int

    @classmethod
    def of(cls, model: Augmented) -> Rows:
        """Return the rows: x, u, efforts e, constants c, time t, step h, inputs q of networks, adjoints."""
        system, nq = model.system, len(model.inputs)
        n, ports = len(system.states), len(system.ports)
        sizes = {"x": n, "u": len(system.inputs), "c": len(system.operating_point), "t": 1}
        sizes |= {"h": 1, "q": nq}
        sizes |= {"z": len(model.networks), "e": ports, "dx": n, "lam": n, "gx": n, "ge": ports}
        sizes |= {"gq": nq, "gz": len(model.networks), "gp": len(model.trainable)}
        # these lie one after the other, not one a row
        sizes |= dict.fromkeys(("weights", "gw"), -(-model.size // LANES))
        sizes |= {"scale": -(-nq // LANES), "gain": -(-len(model.networks) // LANES)}
        first, row = {}, 0
        for name, size in sizes.items():
            first[name] = row
            row += size
        return cls(first, row)

    def at(self, name: str, k: int = 0) -> str:
        """Return the code of a row's number in lane i."""
        return f"w[{(self.first[name] + k) * LANES} + i]"

    def value(self, name: str, k: int) -> str:
        """Return the code of a number that is the same for all lanes."""
        return f"w[{self.first[name] * LANES + k}]"


def layout(model: Augmented) -> Layout:
    """Return the places where the loops find the parts of a block."""
    rows, system = Rows.of(model), model.system
    sizes = {
        "rows": rows.count,
        "states": len(system.states),
        "inputs": len(system.inputs),
        "constants": len(system.operating_point),
        "networks": len(model.networks),
        "trained": len(model.trainable),
        "size": model.size,
    }
    return Layout(**{k: v for k, v in rows.first.items() if k in Layout._fields}, **sizes)


def source(model: Augmented) -> str:
    """Return the text of two functions of the flat block `w` and the parameters `p`, and what they call.

    `evaluate`: dx and z at the state and inputs. `pull`: gx from lam at a state whose z is known,
    while gp and gw grow; gz enters with what the loss itself says of the networks' efforts.
    """
    rows = Rows.of(model)
    system = model.system
    lam = tuple(sp.Dummy(real=True) for _ in system.states)
    mu = tuple(sp.Dummy(real=True) for _ in model.inputs)
    rates = held(system.x, system.closed)
    power = _sum(a * f for a, f in zip(lam, rates, strict=True))
    virtual = _sum(a * q for a, q in zip(mu, model.inputs, strict=True))
    x, e, p = system.x, system.e, model.p
    back = [*gradient(power, x), *gradient(power, e), *gradient(power, p)]
    inner = [*gradient(virtual, x), *gradient(virtual, p)]
    parts = [
        _function(model, rows, "network_inputs", model.inputs, {"q": len(model.inputs)}),
        _function(model, rows, "derivative", rates, {"dx": len(x)}),
        _function(
            model,
            rows,
            "derivative_pullback",
            back,
            {"gx": len(x), "ge": len(e), "+gp": len(p)},
            {"lam": lam},
        ),
        _function(model, rows, "inputs_pullback", inner, {"+gx": len(x), "+gp": len(p)}, {"gq": mu}),
        _networks(model, rows),
        _whole(model, rows),
    ]
    head = "import math\n\nimport numpy as np\n\nfrom unmodelled.engine.compiled.layout import *\n"
    head += "from unmodelled.engine.compiled.scalars import *\n\nBODY = types.void(Array, Array)\n"
    return "\n\n".join([head, *tables(model.system, "\n".join(parts)), *parts])


def _sum(terms: Iterable[sp.Expr]) -> sp.Expr:
    return sum(terms, sp.S.Zero)


def _whole(model: Augmented, rows: Rows) -> str:
    """The two functions that the loops call."""
    ports = model.system.port_names
    efforts = [f"{rows.at('e', k)} = 0.0" for k in range(len(ports))]
    back = []
    for k, network in enumerate(model.networks):
        port = ports.index(network.port)
        efforts.append(f"{rows.at('e', port)} += {rows.at('z', k)}")
        back.append(f"{rows.at('gz', k)} += {rows.at('ge', port)}")
    loop = "    for i in range(LANES):\n"
    body = "\n".join(f"        {line}" for line in efforts or ["pass"])
    returned = "\n".join(f"        {line}" for line in back or ["pass"])
    inputs, forward, backward = (
        ("    network_inputs(w, p)\n", "    networks(w)\n", f"{loop}{returned}\n    networks_pullback(w)\n")
        if model.networks
        else ("", "", "")
    )
    last = "    inputs_pullback(w, p)\n" if model.networks else ""
    return (
        f"@jit(BODY)\ndef evaluate(w, p):\n{inputs}{forward}{loop}{body}\n    derivative(w, p)\n\n\n"
        f"@jit(BODY)\ndef pull(w, p):\n{inputs}{loop}{body}\n    derivative_pullback(w, p)\n{backward}{last}"
    )


def _function(
    model: Augmented,
    rows: Rows,
    name: str,
    expressions: Sequence[sp.Expr],
    targets: Mapping[str, int],
    adjoints: Mapping[str, Sequence[sp.Symbol]] | None = None,
) -> str:
    """A loop over the lanes that writes `expressions` to the rows of `targets`; "+" adds to them."""
    system = model.system
    known = {"x": system.x, "u": system.u, "c": system.c, "e": system.e, "t": (TIME,), "h": (STEP_LENGTH,)}
    groups = {**known, **(adjoints or {})}
    used = {s for e in expressions for s in e.free_symbols}
    # numbered names: nothing that a user wrote stands in the code
    names = {s: f"{g}{k}" for g, members in {**groups, "p": system.p}.items() for k, s in enumerate(members)}
    before, lane, results = assignments(expressions, names, set(system.p))
    load = [f"p{k} = p[{k}]" for k, s in enumerate(system.p) if s in used]
    body = [
        f"{g}{k} = {rows.at(g, k)}"
        for g, members in groups.items()
        for k, s in enumerate(members)
        if s in used
    ] + lane
    cells = [(target, k) for target, size in targets.items() for k in range(size)]
    for (target, k), text in zip(cells, results, strict=True):
        address = rows.at(target.lstrip("+"), k)
        body.append(f"{address} {'+=' if target.startswith('+') else '='} {text}")
    return _loop(name, "w, p", [*load, *before], body)


def _loop(name: str, arguments: str, before: list[str], body: list[str], decorator: str = "jit()") -> str:
    lines = [f"@{decorator}\ndef {name}({arguments}):", *(f"    {line}" for line in before)]
    lines.append("    for i in range(LANES):")
    return "\n".join([*lines, *(f"        {line}" for line in body or ["pass"])]) + "\n"


def _networks(model: Augmented, rows: Rows) -> str:
    """`networks`: z of every network from q; `networks_pullback`: gz to gq and gw (added).

    Here the hidden units are the lanes: their weights and gradients lie side by side.
    """
    forward: list[str] = []
    backward: list[str] = []
    weight, q = 0, 0
    for k, network in enumerate(model.networks):
        forward += _forward(network, rows, k, q, weight)
        backward += _backward(network, rows, k, q, weight)
        weight += network.size
        q += len(network.inputs)
    return (
        _loop("networks", "w", [], forward, "jit(sums=True)")
        + "\n\n"
        + _loop("networks_pullback", "w", [], backward, "jit(sums=True)")
    )


def _cells(network: Network, rows: Rows, name: str, weight: int) -> tuple[list[str], str, str, str]:
    """Addresses of input weights, bias and output weight of unit j, and of the output's bias."""
    ni, nh = len(network.inputs), network.hidden
    start = rows.first[name] * LANES + weight
    inner = [f"w[{start + a * nh} + j]" for a in range(ni)]
    return (
        inner,
        f"w[{start + ni * nh} + j]",
        f"w[{start + (ni + 1) * nh} + j]",
        f"w[{start + (ni + 2) * nh}]",
    )


def _unit(network: Network, inner: list[str], bias: str) -> list[str]:
    sums = "".join(f" + {weight} * q{n}" for n, weight in enumerate(inner))
    return [f"for j in range({network.hidden}):", f"    a = {bias}{sums}"]


def _scaled(network: Network, rows: Rows, q: int) -> list[str]:
    return [
        f"q{a} = {rows.at('q', q + a)} * {rows.value('scale', q + a)}" for a in range(len(network.inputs))
    ]


def _forward(network: Network, rows: Rows, k: int, q: int, weight: int) -> list[str]:
    inner, bias, outer, last = _cells(network, rows, "weights", weight)
    unit = [*_unit(network, inner, bias), f"    z += {outer} * (0.0 if a <= 0.0 else a)"]
    return [
        *_scaled(network, rows, q),
        "z = 0.0",
        *unit,
        f"{rows.at('z', k)} = {rows.value('gain', k)} * (z + {last})",
    ]


def _backward(network: Network, rows: Rows, k: int, q: int, weight: int) -> list[str]:
    inner, bias, outer, _ = _cells(network, rows, "weights", weight)
    g_inner, g_bias, g_outer, g_last = _cells(network, rows, "gw", weight)
    lines = [
        *_scaled(network, rows, q),
        f"g = {rows.value('gain', k)} * {rows.at('gz', k)}",
        f"{g_last} += g",
    ]
    lines += [f"r{a} = 0.0" for a in range(len(inner))]
    lines += _unit(network, inner, bias)
    lines += [f"    {g_outer} += g * (0.0 if a <= 0.0 else a)", f"    d = 0.0 if a <= 0.0 else g * {outer}"]
    lines += [f"    {g_bias} += d"]
    for a, (weights, gradients) in enumerate(zip(inner, g_inner, strict=True)):
        lines += [f"    {gradients} += d * q{a}", f"    r{a} += d * {weights}"]
    return lines + [
        f"{rows.at('gq', q + a)} = r{a} * {rows.value('scale', q + a)}" for a in range(len(inner))
    ]


def tables(system: System, code: str) -> list[str]:
    """Return the text of functions that look up the tables of a system."""
    parts = []
    for k, table in enumerate(system.tables):
        for order in range(4):
            if f"table_{k}_{order}(" not in code:
                continue
            knots, c = table.pieces(order)
            low, high = ("0.0 * x" if order else repr(float(y)) for y in (table.y[0], table.y[-1]))
            parts.append(
                f"KNOTS_{k}_{order} = np.array({knots.tolist()!r})\n"
                f"PIECES_{k}_{order} = np.array({c.T.tolist()!r})\n\n\n"
                f"@jit()\ndef table_{k}_{order}(x):\n"
                f"    if not x > KNOTS_{k}_{order}[0]:\n"
                f"        return {low} if x <= KNOTS_{k}_{order}[0] else x\n"
                f"    if x >= KNOTS_{k}_{order}[-1]:\n        return {high}\n"
                f"    return piece(x, KNOTS_{k}_{order}, PIECES_{k}_{order})\n"
            )
    return parts
