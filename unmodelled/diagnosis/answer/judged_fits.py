"""Models that a judgement leaves: known physics, laws, and the parts of the measurement chain that pay."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from unmodelled.diagnosis.data.gap import LARGEST_ERROR, Gap
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.judge.base import Base
from unmodelled.diagnosis.judge.chain import Key, chain_of, with_priors
from unmodelled.diagnosis.judge.left_out import LeftOutRuns
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.effects.added import Added


@dataclass(frozen=True, eq=False)
class LastFit:
    """A fit whose numbers leave, with every experiment left out once."""

    fitted: FittedHypothesis
    tau: float  # correlation time by which its priors are tightened, samples

    @cached_property
    def around(self) -> Linearised:
        """Return the fit linearised, errors in their own size and correlation time."""
        return Linearised.of(self.fitted, self.tau)

    @cached_property
    def left_out(self) -> LeftOutRuns:
        """Return the experiments left out."""
        return LeftOutRuns.of(self.around)

    @cached_property
    def _leaving(self) -> tuple[Hypothesis, Mapping[str, str]]:
        """The hypothesis without deviations of experiments, and names of its numbers in the fit."""
        effects = self.fitted.hypothesis.effects
        return among(self.fitted.hypothesis, [e.key for e in effects if not e.per_experiment])

    @property
    def leaving(self) -> Hypothesis:
        """Return the hypothesis without deviations of experiments: a new one has deviations of its own."""
        return self._leaving[0]

    @property
    def names(self) -> Mapping[str, str]:
        """Return the names in the fit of the numbers of `leaving`."""
        return self._leaving[1]

    @property
    def laws(self) -> list[Added]:
        """Return the laws, without the chain."""
        return [added for added in self.leaving.effects if not added.priors]

    @property
    def values(self) -> dict[str, float]:
        """Return the numbers that leave, SI, by name."""
        values = self.fitted.fit.values
        return {name: values[own] for name, own in self.names.items() if own in values}

    def judged(self, label: str, every: Study) -> JudgedModel:
        """Return the model with its gap over windows of the horizon of `every`, experiments left out."""
        study = replace(every, system=self.leaving.study.system)
        fit = replace(self.fitted.fit, values=self.values, own={})
        leaves = FittedHypothesis(replace(self.leaving, study=study), self.fitted.recording, fit)
        model = judged_model(label, leaves)
        return replace(model, gap=self._left_out(model.gap))

    def _left_out(self, gap: Gap) -> Gap:
        """The gap, larger by how much worse an experiment is predicted that took no part in the fit."""
        logs, left = self.fitted.recording.logs, self.left_out
        worse = np.sqrt(np.maximum(left.square / np.maximum(left.fitted, 1e-300), 1.0))
        factor = dict(zip((logs.ids[i] for i in self.around.runs), worse.tolist(), strict=True))
        each = {i: min(own * factor[i], LARGEST_ERROR) for i, own in gap.per_experiment.items()}
        samples = dict(zip(logs.ids, np.diff(logs.offsets).tolist(), strict=True))
        before, after = (
            sum(samples[i] * own**2 for i, own in gaps.items()) for gaps in (gap.per_experiment, each)
        )
        larger = float(np.sqrt(after / before)) if before > 0.0 else 1.0
        outputs = {name: larger * own for name, own in gap.per_output.items()}
        return replace(gap, value=larger * gap.value, per_experiment=each, per_output=outputs)


def last_fits(base: Base, fitted: FittedHypothesis, kept: Collection[Key]) -> Iterator[LastFit]:
    """Yield fits with some of the effects over the windows of a base, from the numbers of the larger fit.

    Deviations of experiments are open in one of them and left out in the other. Where they are open, a supply
    that varies bends no number; where the file is a little wrong in all experiments, they absorb it.
    """
    own = {e.key for e in chain_of(fitted.hypothesis) if e.per_experiment}
    for keys in [{*kept, *own}, set(kept)] if own else [set(kept)]:
        hypothesis, names = among(fitted.hypothesis, keys)
        values = fitted.fit.every
        start = {name: values[before] for name, before in names.items() if before in values}
        yield LastFit(base.fit(hypothesis, [start]), base.tau)


def among(whole: Hypothesis, kept: Collection[Key]) -> tuple[Hypothesis, dict[str, str]]:
    """Return a hypothesis with some of its effects, and the names of its numbers in the whole one.

    Beside fewer effects, numbers may have other names.
    """
    found = Hypothesis.known(whole.study)
    names = {u.name: u.name for u in found.unknowns}
    for added, law in zip(whole.effects, whole.laws, strict=True):
        if added.key in kept:
            found = found.plus(law, added.place)
            new = dict(zip(added.units, found.effects[-1].units, strict=True))
            names |= {own: before for before, own in new.items()}
            found = with_priors(found, {new[name]: prior for name, prior in added.priors.items()})
    return found, names
