"""The parts of a measurement chain that pay: whose removal costs evidence."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.judge.chain import Key, chain_of
from unmodelled.diagnosis.judge.linear import Linearised


def paying_parts(around: Linearised) -> list[Key]:
    """Return the parts of the chain that pay, of those that all experiments share.

    All parts are there at first. The one without which the evidence is largest goes, as long as the evidence
    is no smaller without it: a delay of an input and a lag behind it stand in for each other.
    """
    numbers = around.columns.unknowns(own=False)
    names = {u.name: k for k, u in enumerate(numbers)}
    parts = {e.key: [names[n] for n in e.priors if n in names] for e in chain_of(around.fitted.hypothesis)}
    left, gone = [key for key, own in parts.items() if own], list[int]()
    products = around.normal
    while left:
        without = {key: _evidence(around, products, [*gone, *parts[key]]) for key in left}
        least = max(left, key=lambda key: without[key])
        if without[least] < _evidence(around, products, gone):
            break
        left.remove(least)
        gone += parts[least]
    return left


def _evidence(around: Linearised, products: Array, gone: Collection[int]) -> float:
    """Evidence of a fit, nats, with some of its open numbers at zero; every other one costs its price.

    `products` of [open | residual] have the priors. Numbers at a bound stay there.
    """
    numbers, fitted = around.columns.unknowns(own=False), around.fitted
    back = np.eye(len(products))
    for k in gone:
        back[k, -1] = fitted.fit.values[numbers[k].name] / numbers[k].scale
    moved = back.T @ products @ back
    kept = [k for k, u in enumerate(numbers) if k not in gone and not fitted.at_bound(u.name)]
    H, g = moved[np.ix_(kept, kept)], moved[kept, -1]
    square = float(moved[-1, -1] - g @ np.linalg.solve(H, g))
    return around.likelihood(square, around.weights.price(len(kept)))
