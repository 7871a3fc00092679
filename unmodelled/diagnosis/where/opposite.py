"""Ports at which equal and opposite efforts are missing: something acts between their bodies."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from unmodelled.diagnosis.where.corrections import Corrections
from unmodelled.systems.model import Port
from unmodelled.systems.units import parse_unit


def opposite_ports(lacking: Corrections) -> tuple[str, ...]:
    """Return a sentence for every pair of ports between which an effort is missing.

    Of what two independent efforts explain, one effort that acts on both bodies in opposite directions must
    leave next to nothing in comparison with an effort at a single port.

    Args:
        lacking: corrections of the physics without effects.

    Returns:
        Sentences with the lines of a port between the two; none where there is no such pair.
    """
    ports = {port.name: port for port in lacking.model.system.ports}
    at = {place.name: k for k, place in enumerate(lacking.places) if place.kind == "port"}
    return tuple(
        _sentence(ports[one], ports[other])
        for one, other in combinations(at, 2)
        if _comparable(ports[one], ports[other]) and _is_opposite(lacking, at[one], at[other])
    )


def _comparable(one: Port, other: Port) -> bool:
    units = {parse_unit(port.unit).dimension for port in (one, other)}
    return len(units) == 1 and all(p.domain == "power" and p.velocity is not None for p in (one, other))


def _is_opposite(lacking: Corrections, one: int, other: int) -> bool:
    pair = [one, other]
    curvature, gradient = lacking.curvature[:, pair][:, :, pair], lacking.gradient[:, pair]
    ways = np.array([[1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    weight = np.einsum("ka,wab,kb->wk", ways, curvature, ways)
    known = (weight > 0.0).all(1) & (np.linalg.det(curvature) > 0.0)
    if not known.any():
        return False
    # noise alone explains one per window and number
    opposite, *alone = np.sum((gradient[known] @ ways.T) ** 2 / weight[known] - 1.0, axis=0).tolist()
    step = np.linalg.solve(curvature[known], gradient[known, :, None])[:, :, 0]
    both = float(np.sum(gradient[known] * step) - 2.0 * known.sum())
    rest = lacking.thresholds.opposite_rest
    left = both - max(alone)
    return both > 0.0 and left > rest**2 * both and both - opposite <= rest * left


def _sentence(one: Port, other: Port) -> str:
    name, effort = f"{one.name}_{other.name}", f"{one.effort}_{other.effort}"
    coordinates = ", ".join(f"{kind}: {short}_{name}" for kind, short, _ in _differences(one, other))
    signals = ", ".join(f"{short}_{name}: {difference}" for _, short, difference in _differences(one, other))
    return (
        f"equal and opposite efforts are missing at {one.name} and {other.name}: something acts between "
        f"them. To have effects tried there, add under signals: {{{signals}}}, under ports: {{{name}: "
        f"{{effort: {effort}, unit: {one.unit}, {coordinates}}}}}, and in the equations write "
        f"({one.effort} + {effort}) for {one.effort} and ({other.effort} - {effort}) for {other.effort}"
    )


def _differences(one: Port, other: Port) -> Iterator[tuple[str, str, str]]:
    """Coordinates that both ports have: kind, first letter of the signal, and the signal."""
    if one.position is not None and other.position is not None:
        yield "position", "x", f"{one.position} - {other.position}"
    yield "velocity", "v", f"{one.velocity} - {other.velocity}"
