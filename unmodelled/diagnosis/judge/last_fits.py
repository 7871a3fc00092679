"""Models that a judgement leaves: known physics, laws, and the parts of the measurement chain that pay."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from unmodelled.diagnosis.data.gap import LARGEST_ERROR
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.fitting.unknowns import Start
from unmodelled.diagnosis.judge.base import Base
from unmodelled.diagnosis.judge.chain import Key, chain_of
from unmodelled.diagnosis.judge.left_out import LeftOutRuns
from unmodelled.diagnosis.judge.linear import Linearised
from unmodelled.diagnosis.judge.paying import paying_parts
from unmodelled.diagnosis.judge.refit import Parent
from unmodelled.effects.added import Added
from unmodelled.systems.model import System


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
        whole = self.fitted.hypothesis
        kept = [e.key for e in whole.effects if not (e.usual and e.per_experiment)]
        return among(whole, kept, whole.study.system)

    @property
    def leaving(self) -> Hypothesis:
        """Return the hypothesis without usual deviations: a new experiment has deviations of its own."""
        return self._leaving[0]

    @property
    def names(self) -> Mapping[str, str]:
        """Return the names in the fit of the numbers of `leaving`."""
        return self._leaving[1]

    @property
    def laws(self) -> list[Added]:
        """Return the laws, without the chain."""
        return [added for added in self.leaving.effects if not added.usual]

    @property
    def values(self) -> dict[str, float]:
        """Return the numbers that leave, SI, by name."""
        values = self.fitted.fit.values
        return {name: values[own] for name, own in self.names.items() if own in values}

    def judged(self, label: str, every: Study) -> JudgedModel:
        """Return the model with its gap over windows of the horizon of `every`, all experiments fitted."""
        study, whole = replace(every, system=self.leaving.study.system), self.fitted.fit
        # such as the start of a state that no sensor shows
        own = {u.name: whole.own[self.names[u.name]] for u in self.leaving.unknowns if u.own}
        fit = replace(whole, values=self.values, own=own)
        leaves = FittedHypothesis(replace(self.leaving, study=study), self.fitted.recording, fit)
        return judged_model(label, leaves)

    def left_out_of(self, model: JudgedModel) -> JudgedModel:
        """Return a model of this fit with its gap of experiments left out.

        The gap is larger by how much worse an experiment is predicted that took no part in the fit.
        """
        logs, worse, gap = self.fitted.recording.logs, self.left_out.worse, model.gap
        factor = dict(zip((logs.ids[i] for i in self.around.runs), worse.tolist(), strict=True))
        each = {i: min(own * factor[i], LARGEST_ERROR) for i, own in gap.per_experiment.items()}
        samples = dict(zip(logs.ids, np.diff(logs.offsets).tolist(), strict=True))
        before, after = (
            sum(samples[i] * own**2 for i, own in gaps.items()) for gaps in (gap.per_experiment, each)
        )
        larger = float(np.sqrt(after / before)) if before > 0.0 else 1.0
        outputs = {name: larger * own for name, own in gap.per_output.items()}
        value = larger * gap.value
        return replace(model, gap=replace(gap, value=value, per_experiment=each, per_output=outputs))


def last_fits(
    last: Parent, system: System, laws: Collection[Key], chain: Collection[Key], named: Collection[Key] = ()
) -> Iterator[LastFit]:
    """Yield fits of a system with some of the laws and parts of the chain of a larger fit, over its windows.

    Parts of the chain that are `named` are laws in them.

    Deviations of experiments are open in one of them and left out in the other. Where they are open, a supply
    that varies bends no number; where the file is a little wrong in all experiments, they absorb it.
    """
    own = {e.key for e in chain_of(last.fitted.hypothesis) if e.per_experiment}
    yield from (_fit(last, system, {*laws, *chain, *more}, named) for more in ([own, ()] if own else [()]))


def paying_chain(last: Parent) -> list[Key]:
    """Return the parts of the chain that pay in the fit with all laws.

    The fit is repeated without the others until all of them pay: of parts that stand in for each other, the
    evidence of a linear step keeps too many.
    """
    chain = paying_parts(Linearised.of(last.fitted, last.base.tau))
    while chain:
        fewer = paying_parts(_with_chain(last, chain).around)
        if set(fewer) == set(chain):
            break
        chain = fewer
    return chain


def _with_chain(last: Parent, chain: Collection[Key]) -> LastFit:
    """The fit with all laws, some parts of the chain, and deviations of experiments."""
    whole = last.fitted.hypothesis
    own = [e.key for e in whole.effects if not e.usual or e.per_experiment]
    return _fit(last, whole.study.system, {*own, *chain})


def physics_fit(last: Parent, system: System) -> LastFit:
    """Return the fit of the known physics over the same windows."""
    physics = last.base.physics
    known = Hypothesis.known(replace(physics.hypothesis.study, system=system))
    return LastFit(replace(physics, hypothesis=known), last.base.tau)


def _fit(last: Parent, system: System, kept: Collection[Key], named: Collection[Key] = ()) -> LastFit:
    """A fit of a system with some of the effects of a larger fit, from its numbers; those `named` are laws.

    Priors are tightened by the correlation time of what the larger fit leaves.
    """
    tau, values = float(last.residual.tau.max()), last.fitted.fit.every
    hypothesis, names = among(last.fitted.hypothesis, kept, system, float(np.sqrt(last.base.tau / tau)))
    start = {name: values[before] for name, before in names.items() if before in values}
    effects = tuple(replace(e, usual=e.usual and e.key not in named) for e in hypothesis.effects)
    return LastFit(settled(last.base, replace(hypothesis, effects=effects), start), tau)


def settled(base: Base, hypothesis: Hypothesis, start: Start) -> FittedHypothesis:
    """Return a fit, continued once where it ended while its error still fell."""
    first = base.fit(hypothesis, start)
    if first.fit.converged:
        return first
    second = base.fit(hypothesis, first.fit.every)
    simulations = first.fit.simulations + second.fit.simulations
    return replace(second, fit=replace(second.fit, simulations=simulations))


def among(
    whole: Hypothesis, kept: Collection[Key], system: System, wider: float = 1.0
) -> tuple[Hypothesis, dict[str, str]]:
    """Return a hypothesis with some of the effects of another one, and the names of its numbers in that one.

    Beside fewer effects, numbers may have other names. Priors are `wider` by a factor.
    """
    found = Hypothesis.known(replace(whole.study, system=system))
    names = {u.name: u.name for u in found.unknowns}
    for added, law in zip(whole.effects, whole.laws, strict=True):
        if added.key in kept:
            found = found.again(added, law, wider)
            names |= dict(zip(found.effects[-1].units, added.units, strict=True))
    return found, names
