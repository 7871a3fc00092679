"""Models that a judgement leaves: known physics, laws, and the parts of the measurement chain that pay."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from unmodelled.diagnosis.data.gap import LARGEST_ERROR, Gap
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.judge.base import Base
from unmodelled.diagnosis.judge.chain import Key, with_priors
from unmodelled.diagnosis.judge.judgement import Judgement
from unmodelled.diagnosis.judge.left_out import LeftOutRuns
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.paying import paying_parts
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

    def judged(self, label: str, study: Study) -> JudgedModel:
        """Return the model with its gap over windows of the horizon of `study`, experiments left out."""
        every = replace(study, system=self.fitted.hypothesis.study.system)
        hypothesis = replace(self.fitted.hypothesis, study=every)
        model = judged_model(label, replace(self.fitted, hypothesis=hypothesis))
        return replace(model, gap=self._left_out(model.gap))

    def _left_out(self, gap: Gap) -> Gap:
        """The gap, larger by how much worse an experiment is predicted that took no part in the fit."""
        logs, worse = self.fitted.recording.logs, self.left_out.worse
        factor = dict(zip((logs.ids[i] for i in self.around.runs), worse.tolist(), strict=True))
        each = {i: min(own * factor[i], LARGEST_ERROR) for i, own in gap.per_experiment.items()}
        samples = dict(zip(logs.ids, np.diff(logs.offsets).tolist(), strict=True))
        before, after = (
            sum(samples[i] * own**2 for i, own in gaps.items()) for gaps in (gap.per_experiment, each)
        )
        larger = float(np.sqrt(after / before)) if before > 0.0 else 1.0
        outputs = {name: larger * own for name, own in gap.per_output.items()}
        return replace(gap, value=larger * gap.value, per_experiment=each, per_output=outputs)


@dataclass(frozen=True, eq=False)
class LastFits:
    """The fits of a judgement whose numbers leave."""

    reidentified: LastFit  # the known physics
    steps: tuple[LastFit, ...]  # with one law more each
    chained: LastFit | None  # with the parts of the chain that pay, where there are some and no law

    @classmethod
    def of(cls, found: Judgement) -> LastFits:
        """Fit the models again without the parts of the chain that do not pay, over the same windows.

        What differs between experiments is left out, too: a new experiment has deviations of its own.
        """
        base, last = found.look.parent.base, found.final.fitted
        kept, keys = paying_parts(found.final.around), [law.key for law in laws_of(last)]
        steps = [_fit(base, last, {*kept, *keys[: k + 1]}) for k in range(len(keys))]
        chained = _fit(base, last, kept) if kept and not keys else None
        return cls(LastFit(base.physics, base.tau), tuple(steps), chained)


def laws_of(fitted: FittedHypothesis) -> list[Added]:
    """Return the laws of a fit, without its chain."""
    return [added for added in fitted.hypothesis.effects if not added.priors]


def _fit(base: Base, fitted: FittedHypothesis, kept: Collection[Key]) -> LastFit:
    """A fit with some of the effects, which starts from the numbers of the larger one."""
    hypothesis, start = _among(fitted, kept)
    return LastFit(base.fit(hypothesis, [start]), base.tau)


def _among(fitted: FittedHypothesis, kept: Collection[Key]) -> tuple[Hypothesis, Start]:
    """The hypothesis with some of the effects, priors with them, and their fitted numbers."""
    whole, values = fitted.hypothesis, fitted.fit.every
    found = Hypothesis.known(whole.study)
    start = {u.name: values[u.name] for u in found.unknowns if u.name in values}
    for added, law in zip(whole.effects, whole.laws, strict=True):
        if added.key in kept:
            found = found.plus(law, added.place)
            # beside fewer effects, numbers may have other names
            names = dict(zip(added.units, found.effects[-1].units, strict=True))
            start |= {names[n]: values[n] for n in added.units if n in values}
            found = with_priors(found, {names[n]: prior for n, prior in added.priors.items()})
    return found, start
