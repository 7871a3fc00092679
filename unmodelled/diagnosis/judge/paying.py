"""The parts of a measurement chain that pay: whose removal costs evidence."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.fitting.hypothesis import AT_BOUND_SHARE
from unmodelled.diagnosis.judge.chain import Key, chain_of
from unmodelled.diagnosis.judge.linear import Linearised


def paying_parts(around: Linearised) -> list[Key]:
    """Return the parts of the chain that pay, of those that all experiments share.

    All parts are there at first. The one without which the evidence is largest goes, or all of one input or
    output, as long as the evidence is no smaller without: a delay of an input and a lag behind it stand in
    for each other, and an early input makes up for a lag.
    """
    numbers = around.columns.unknowns(own=False)
    names = {u.name: k for k, u in enumerate(numbers)}
    parts = {e.key: [names[n] for n in e.priors if n in names] for e in chain_of(around.fitted.hypothesis)}
    left, gone = [key for key, own in parts.items() if own], list[int]()
    products = around.normal
    while left:
        places = dict.fromkeys(key[2] for key in left)
        every = [*((key,) for key in left), *(tuple(k for k in left if k[2] == place) for place in places)]
        numbers_of = {some: [n for key in some for n in parts[key]] for some in every}
        without = {some: _evidence(around, products, [*gone, *own]) for some, own in numbers_of.items()}
        least = max(without, key=lambda some: without[some])
        if without[least] < _evidence(around, products, gone):
            break
        left = [key for key in left if key not in least]
        gone += numbers_of[least]
    return left


def _evidence(around: Linearised, products: Array, gone: Collection[int]) -> float:
    """Evidence of a fit, nats, with some of its open numbers at zero; every other one costs its price.

    `products` of [open | residual] have the priors. Numbers at a bound stay there, at zero if that is it.
    """
    numbers, fitted = around.columns.unknowns(own=False), around.fitted
    back = np.eye(len(products))
    for k in gone:
        value = fitted.fit.values[numbers[k].name] / numbers[k].scale
        none = abs(value) <= AT_BOUND_SHARE and fitted.at_bound(numbers[k].name)
        back[k, -1] = 0.0 if none else value
    moved = back.T @ products @ back
    kept = [k for k, u in enumerate(numbers) if k not in gone and not fitted.at_bound(u.name)]
    H, g = moved[np.ix_(kept, kept)], moved[kept, -1]
    square = float(moved[-1, -1] - g @ np.linalg.solve(H, g))
    return around.likelihood(square, around.weights.price(len(kept)))
