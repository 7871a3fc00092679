"""Compute the best possible diagnosis: the effects are known, only their parameters are fitted."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pipeline.withheld.channels import parameter_channels
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.gap import shrink
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.deviation import errors
from unmodelled.diagnosis.fitting.floor import floor
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import values_per_experiment
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.systems.model import System

#: Of the shapes of one variant: values that a fit starts from, at most.
STARTS = 64


@dataclass(frozen=True)
class Known:
    """A planted effect."""

    family: str
    channel: str
    factor: str | None = None  # of the operating point, at one level of which the effect acts
    level: float | str | None = None  # of the factor

    def candidates(self, system: System) -> Iterator[tuple[Effect, Place]]:
        """Yield the variants of the family with all their places at this channel."""
        acts_at = parameter_channels(system)
        for effect in effects():
            if effect.family != self.family:
                continue
            for place in effect.places(system):
                if self.channel in (place.channel, *acts_at.get(place.channel, ())):
                    yield effect, replace(place, factor=self.factor, level=self.level)


@dataclass(frozen=True)
class Oracle:
    """Gap that remains with known effects on held-out experiments, in standard deviations of the outputs.

    The two gaps are the same if there are no effects.
    """

    reidentified: float  # gap of the physics with refitted parameters
    augmented: float  # gap with the known effects
    floor: float  # noise floor of the latter gap
    gap_seen: bool  # the physics with refitted parameters has a gap (`Judged.has_gap`)
    #: Per effect: the model without it, but with the other known effects, is worse (`Judged.is_worse_than`);
    #: a diagnosis cannot be expected to find other effects
    seen: tuple[bool, ...]
    variants: tuple[str, ...]  # best-fitting one of every effect; empty for a family with a single variant

    @property
    def shrink(self) -> float:
        """Share of the squared gap above the floor that the known effects explain; 0 without a gap."""
        return shrink(self.reidentified, self.augmented, self.floor)


def oracle(study: Study, known: Sequence[Known]) -> Oracle:
    """Fit the physics with the known effects, and assess the contribution of every effect.

    Every variant of a family is fitted from starts over all its shapes; the variant with the smallest gap on
    the training experiments is kept. Of several effects, the effect that explains most is added first.
    Effects of families outside the library are left out.
    """
    named = [effect for effect in known if any(effect.candidates(study.system))]
    refits = _Refits(FittedHypothesis.of(Hypothesis.known(study), study.recording))
    best = refits.with_all(named)
    without, augmented = Judged.of(refits.base), Judged.of(best)
    seen = {}
    for k, effect in enumerate(named):
        others = refits.with_all([*named[:k], *named[k + 1 :]])
        seen[effect] = Judged.of(others).is_worse_than(augmented)
    chosen = {e.family: e for e in best.hypothesis.effects}
    return Oracle(
        reidentified=without.gap,
        augmented=augmented.gap,
        floor=augmented.floor,
        gap_seen=without.has_gap,
        seen=tuple(seen.get(effect, False) for effect in known),
        variants=tuple(chosen[e.family].variant if e.family in chosen else "" for e in known),
    )


class _Refits:
    """Fits of what is known, each of them done once; `base` is the refitted physics without any effect."""

    def __init__(self, base: FittedHypothesis) -> None:
        self.base = base
        self._found: dict[tuple[Known, ...], FittedHypothesis] = {(): base}

    def with_all(self, known: Sequence[Known]) -> FittedHypothesis:
        """With all effects, the one that explains most first."""
        chosen: tuple[Known, ...] = ()
        while len(chosen) < len(known):
            ways = [(*chosen, effect) for effect in known if effect not in chosen]
            chosen = min(ways, key=lambda way: _gap(self._with(way)))
        return self._with(chosen)

    def _with(self, known: tuple[Known, ...]) -> FittedHypothesis:
        if known not in self._found:
            self._found[known] = _best(self._with(known[:-1]), known[-1])
        return self._found[known]


def _best(fitted: FittedHypothesis, effect: Known) -> FittedHypothesis:
    """One effect more: its best variant."""
    study, found = fitted.hypothesis.study, []
    for variant, place in effect.candidates(study.system):
        # behind a drive with a state of its own, no law depends on the speed that the input drives
        if place.everywhere not in variant.places(fitted.hypothesis.system):
            continue
        hypothesis = fitted.hypothesis.plus(variant, place)
        shapes = hypothesis.effects[-1].shapes
        points = [dict(zip(shapes, values, strict=True)) for values in product(*shapes.values())]
        chosen = np.unique(np.linspace(0, len(points) - 1, STARTS).astype(int))
        starts = [{**fitted.fit.values, **points[k]} for k in chosen]
        found.append(FittedHypothesis.of(hypothesis, study.recording, starts))
    return min(found, key=_gap)


def _gap(fitted: FittedHypothesis) -> float:
    return fitted.fit.gap.value


#: Of the floor: the least that an effect must contribute to the gap to be seen.
SEEN = 0.25
#: How many times as large as the floor a gap must be, which is not known better than that.
BEYOND = 1.2
#: Draws of the bootstrap.
DRAWS = 1000


@dataclass(frozen=True)
class Judged:
    """Distance between free runs of a model and held-out measurements."""

    square: Array  # (windows,), mean over samples and outputs, in variances of the outputs
    samples: Array  # (windows,)
    floor: float  # noise floor of the gap, in standard deviations of the outputs

    @classmethod
    def of(cls, fitted: FittedHypothesis) -> "Judged":
        """Assess a fitted model in windows that start at the measured states; see `deviation.gap`."""
        study = fitted.hypothesis.study
        recording = Recording.of(study.logs, study.horizon, study.held_out, study.latest, study.sensors)
        simulation = fitted.hypothesis.simulation(recording)
        numbers = _numbers(fitted)
        runs = simulation(numbers, substeps=fitted.fit.substeps)
        square = errors(runs, recording.scale) ** 2 * recording.counted[:, :, None]
        samples = recording.steps.astype(np.float64)
        left = floor(simulation, numbers, fitted.fit.substeps).value
        return cls(square.sum(axis=1).mean(axis=1) / samples, samples, left)

    @property
    def gap(self) -> float:
        """Root mean square error over windows, samples and outputs, in standard deviations of the outputs."""
        return float(np.sqrt(np.average(self.square, weights=self.samples)))

    @property
    def has_gap(self) -> bool:
        """Whether the gap is larger than noise explains."""
        return self.gap > BEYOND * self.floor

    def is_worse_than(self, other: "Judged") -> bool:
        """Tell whether another model is better by more than chance and by more than a part of the noise.

        The mean squared error of the other model must be lower by more than the square of a quarter of the
        floor, and by more than zero in 97.5 % of the bootstrap samples of the windows.
        """
        rise = self.square - other.square
        drawn = np.random.default_rng(0).integers(0, len(rise), (DRAWS, len(rise)))
        means = np.sum((rise * self.samples)[drawn], axis=1) / np.sum(self.samples[drawn], axis=1)
        large = np.average(rise, weights=self.samples) > (SEEN * other.floor) ** 2
        return bool(large and np.quantile(means, 0.025) > 0.0)


def _numbers(fitted: FittedHypothesis) -> Array:
    """(experiments, 1, numbers) of the fit, and of every held-out experiment the values of its own."""
    numbers, names = fitted.fit.numbers.copy(), fitted.unknowns.simulation.names
    for name, values in values_per_experiment(fitted).items():
        numbers[:, 0, names.index(name)] = [values[i] for i in fitted.recording.logs.ids]
    return numbers
