"""A network in every port: the reference of a flexible model."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.effects.added import Added
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales, Spread
from unmodelled.effects.substitution import with_law
from unmodelled.systems.model import Parameter, Port, System, symbol

#: Family of a network.
NETWORK = "network"
#: Random hidden units of the network in one port.
HIDDEN = 20
#: Largest weight of a unit, in the effort that the known physics lacks, so that units do not cancel.
LARGEST_WEIGHT = 2.0
#: Prior standard deviations of the weights, of which the likeliest one counts.
WEIGHT_PRIORS = 0.3, 0.1, 0.03, 0.01, 0.003, 0.001
#: Iterations of the fit, and the share of the loss by which one must lower it, or the fit ends: what further
#: iterations gain is noise of the fitted experiments, and steep units, which take many integration steps.
ITERATIONS, LEAST_GAIN = 3, 0.01
#: Steepness of units whose inputs reach from -1 to 1: from nearly straight to nearly a step.
STEEPNESS = 0.5, 30.0
#: Steepness of further units at rest, where friction has its step.
AT_REST = 3.0, 10.0, 30.0


def fit_network(base: FittedHypothesis, seed: int, ports: Collection[str]) -> FittedHypothesis:
    """Fit a network in some ports of a fitted model, beside its effects; without ports there is none."""
    if not ports:
        return base
    first, around = with_networks(base.hypothesis, seed, ports), Linearised.of(base, 1.0)
    networks = first.effects[len(base.hypothesis.effects) :]
    units = np.concatenate([around.columns.of_regressors(network) for network in networks], axis=3)
    products = around.reduced(around.products(units))[around.sigma].products
    prior = max(WEIGHT_PRIORS, key=lambda prior: _evidence(products, prior, around.weights.samples))
    best = _with_prior(first, prior)
    start, substeps = base.fit.values, base.fit.substeps
    return FittedHypothesis.of(best, base.recording, [dict(start)], ITERATIONS, substeps, LEAST_GAIN)


def _evidence(products: Array, prior: float, samples: float) -> float:
    """Evidence, nats, of weights with a prior, integrated out; products of [units | residual]."""
    G, g, square = products[:-1, :-1], products[:-1, -1], float(products[-1, -1])
    left = square - float(g @ np.linalg.solve(G + np.eye(len(g)) / prior**2, g))
    price = 0.5 * float(np.linalg.slogdet(np.eye(len(g)) + prior**2 * G)[1])
    return -0.5 * samples * float(np.log(max(left, 1e-12 * square))) - price


def with_networks(base: Hypothesis, seed: int, ports: Collection[str]) -> Hypothesis:
    """Return a hypothesis with a network in some ports.

    The network's inputs are position (and sine and cosine of an angle), velocity and inputs. The hidden layer
    is random and only the output layer is fitted (a random-feature network), so that its fit has no local
    minima and the same seed gives the same network.
    """
    for number, port in enumerate(base.system.ports):
        if port.name not in ports:
            continue
        added = _network(base.system, port, base.study.scales, np.random.default_rng([seed, 1, number]))
        base = Hypothesis(base.study, added.system, (*base.effects, added), base.laws)
    return base


def _with_prior(hypothesis: Hypothesis, prior: float) -> Hypothesis:
    """The hypothesis with weights of this prior standard deviation, a share of the effort that is missing."""
    effects = [
        replace(e, priors={name: prior * size for name, size in e.scales.items()})
        if e.family == NETWORK
        else e
        for e in hypothesis.effects
    ]
    return Hypothesis(hypothesis.study, hypothesis.system, tuple(effects), hypothesis.laws)


def _network(system: System, port: Port, scales: Scales, rng: np.random.Generator) -> Added:
    seen = [*port.coordinates, *(i.name for i in system.inputs)]
    angles = {state.name for state in system.states if state.unit == "rad"} & {port.position}
    scaled = [_scaled(system.expression(name), scales.of[name]) for name in seen]
    # much of what depends on an angle is the same a turn later
    scaled += [
        wave(system.expression(name)) for name in sorted(map(str, angles)) for wave in (sp.sin, sp.cos)
    ]
    weights, biases = _drawn(len(scaled), rng)
    units = [
        sp.tanh(sum((float(w) * q for w, q in zip(row, scaled, strict=True)), sp.Float(bias)))
        for row, bias in zip(weights.tolist(), biases.tolist(), strict=True)
    ]
    if port.velocity:
        v, half = system.expression(port.velocity), scales.of[port.velocity].half
        units += [sp.tanh(sp.Float(steep / half) * v) for steep in AT_REST]
    names = tuple(f"network_{port.name}_{k + 1}" for k in range(len(units)))
    size = scales.effort[port.name]
    bounds = (-LARGEST_WEIGHT * size, LARGEST_WEIGHT * size)
    law = sum((symbol(n) * unit for n, unit in zip(names, units, strict=True)), sp.S.Zero)
    grown = with_law(system, port, law, " + ".join(names))
    numbers = tuple(Parameter(name, port.unit, 0.0, True, bounds) for name in names)
    return Added(
        *(NETWORK, "", Place("port", port.name)),
        replace(grown, parameters=(*grown.parameters, *numbers)),
        law=f"network of {', '.join(seen)}",
        amplitudes=names,
        regressors=tuple(units),
        bounds=dict.fromkeys(names, bounds),
        scales=dict.fromkeys(names, size),
        units=dict.fromkeys(names, port.unit),
    )


def _scaled(expression: sp.Expr, spread: Spread) -> sp.Expr:
    return (expression - spread.middle) / spread.half


def _drawn(inputs: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Weights (HIDDEN, inputs) in any direction, and biases (HIDDEN,) that put the steps within reach."""
    directions = rng.standard_normal((HIDDEN, inputs))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # half of the units look along one input only: laws of a single coordinate are the rule
    directions[::2] = np.eye(inputs)[np.arange(len(directions[::2])) % inputs]
    steep = np.geomspace(*STEEPNESS, HIDDEN)[rng.permutation(HIDDEN)]
    return steep[:, None] * directions, steep * rng.uniform(-0.8, 0.8, HIDDEN)
