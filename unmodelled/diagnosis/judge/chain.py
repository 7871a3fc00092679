"""The measurement chain, a part of every hypothesis: what every log has, and how large it usually is."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from unmodelled.diagnosis.fitting.hypothesis import INPUT_TIMING, FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.effects.added import Added
from unmodelled.effects.effect import Effect
from unmodelled.effects.input_dependence import unused_inputs
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place

#: Standard deviations of its prior beyond which a number is no usual part of a chain.
UNUSUAL = 3.0
Key = tuple[str, str, Place]


def with_chain(physics: Hypothesis, tau: float = 1.0, without: Collection[Key] = ()) -> Hypothesis:
    """Return a hypothesis with everything that is usual in logs, each number with its prior.

    Gains of inputs and losses differ between experiments, inputs act late and behind a small lag, outputs are
    late, and their gain and zero are a little off. Without priors this chain stands in for the machine: a
    delay of 163 ms did so for a damping. A prior counts against independent samples, and a fit counts all of
    them: with errors that are correlated over `tau` samples, priors are tighter by the root. Parts `without`
    are left out.
    """
    found, period = physics, physics.study.logs.period
    for effect, place in _every(physics):
        if (effect.family, effect.variant, place) in without:
            continue
        larger = found.plus(effect, place)
        usual = effect.usual(larger.effects[-1], period)
        if usual:
            found = as_chain(larger, {name: size / np.sqrt(tau) for name, size in usual.items()})
    return found


def with_priors(hypothesis: Hypothesis, priors: Mapping[str, float]) -> Hypothesis:
    """Return a hypothesis whose last effect has further priors, SI, by number."""
    *others, last = hypothesis.effects
    return replace(hypothesis, effects=(*others, replace(last, priors={**last.priors, **priors})))


def as_chain(hypothesis: Hypothesis, priors: Mapping[str, float]) -> Hypothesis:
    """Return a hypothesis whose last effect is a part of the chain, with priors, SI, by number.

    Within about half a sample, when a logged input acts is never known: it may act earlier, too.
    """
    *others, last = hypothesis.effects
    study, bounds = hypothesis.study, dict(last.bounds)
    for name, place in last.delays.items():
        if place.kind == "actuator":
            early = INPUT_TIMING * study.input_periods[place.name]
            bounds[name] = -early, bounds[name][1]
    last = replace(last, usual=True, bounds=bounds)
    return with_priors(replace(hypothesis, effects=(*others, last)), priors)


def _every(physics: Hypothesis) -> list[tuple[Effect, Place]]:
    """Effects and places; what differs between experiments comes first, a memory last.

    An input that no equation uses has no chain: behind a lag it would be used.
    """
    unused = {Place("actuator", name) for name in unused_inputs(physics.study.system)}
    found = [
        (effect, place)
        for effect in effects()
        for place in effect.places(physics.study.system)
        if place not in unused
    ]
    usual = [
        (effect, place, effect.add(physics.system, place, physics.study.scales))
        for effect, place in found
        if type(effect).usual is not Effect.usual
    ]
    usual.sort(key=lambda one: (not one[2].per_experiment, bool(one[2].memory)))
    return [(effect, place) for effect, place, _ in usual]


def starts_of_chain(hypothesis: Hypothesis) -> list[Start]:
    """Return starts of the chain: half a sample late, a sample of lag, right sensors, experiments alike.

    An input that jumps at samples makes optima at whole samples and between them: a start on time follows.
    """
    late = [0.5, 0.0] if any(item.hold for item in hypothesis.study.system.inputs) else [0.5]
    return [_start(hypothesis, share * hypothesis.study.logs.period) for share in late]


def _start(hypothesis: Hypothesis, late: float) -> Start:
    """Start of the chain with one delay of inputs and outputs, s."""
    period, found = hypothesis.study.logs.period, dict[str, float]()
    for added in chain_of(hypothesis):
        found |= dict.fromkeys(added.delays, late)
        found |= dict.fromkeys(added.shapes, period) if added.memory else {}
        found |= dict.fromkeys((*added.per_experiment, *added.amplitudes), 0.0)
        for name in added.shares:
            found.pop(name)
    return found


def chain_of(hypothesis: Hypothesis) -> list[Added]:
    """Return the parts of the chain in a hypothesis."""
    return [added for added in hypothesis.effects if added.usual]


def unusual_parts(fitted: FittedHypothesis, tau: float) -> list[Key]:
    """Return the parts of the chain with a number that is further from zero than such numbers usually are.

    They are findings, such as a heater that lags by 40 s: they leave the chain and compete as laws. What is
    late on the way from an input to an output is one number in several parts: where their sum is unusual, the
    latest part leaves.
    """
    values, parts = fitted.fit.values, chain_of(fitted.hypothesis)
    sizes = {e.key: {n: prior * np.sqrt(tau) for n, prior in e.priors.items() if n in values} for e in parts}
    far = [k for k, own in sizes.items() if any(abs(values[n]) > UNUSUAL * size for n, size in own.items())]
    if far:
        return far
    late = [e for e in parts if e.delays or e.memory]
    ways = product(*({e.place for e in late if e.place.kind == kind} for kind in ("actuator", "sensor")))
    for ends in ways:
        own = [(e.key, n, size) for e in late if e.place in ends for n, size in sizes[e.key].items()]
        total = sum(values[name] for _, name, _ in own)
        if abs(total) > UNUSUAL * float(np.sqrt(sum(size**2 for *_, size in own))):
            return [max(own, key=lambda one: abs(values[one[1]]))[0]]
    return []
