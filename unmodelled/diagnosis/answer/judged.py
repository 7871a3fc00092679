"""A diagnosis by evidence: the judge names laws, and the models that leave are fitted and assessed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from unmodelled.diagnosis.answer.assembled import Answered, assembled
from unmodelled.diagnosis.answer.models import Models, models_of
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel, LogFault
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.diagnosis.judge.judgement import Judgement, judge
from unmodelled.diagnosis.judge.known_physics import known_physics
from unmodelled.diagnosis.judge.last_fits import LastFit
from unmodelled.diagnosis.judge.network import fit_network
from unmodelled.effects.added import Added
from unmodelled.effects.ports_between import with_all_ports_between, with_named_ports
from unmodelled.systems.model import System


@dataclass(frozen=True, eq=False)
class Judged:
    """The laws for which the evidence of the logs stands, and the models that leave."""

    study: Study  # with the inputs of the judged model, and the ports between others at which laws act
    found: Judgement
    models: Models
    every: Study  # as given, every experiment left out once: that of the gaps

    @property
    def laws(self) -> list[Added]:
        """Return what is named, as it leaves: laws, and the part of the chain that is an effect."""
        return self.models.augmented.last.laws

    @property
    def names_all(self) -> bool:
        """Return whether nothing is left that no law names."""
        return self.found.verdict not in ("main_effect", "unknown")


def judged_models(given: Study, workers: int, progress: Callable[[str], None]) -> Judged:
    """Name laws beside the chain that every log has, and fit the models that leave.

    No experiment is held out before: each is left out once, and the gaps are those of experiments left out.
    """
    system, logs = given.system, given.logs

    # 3. The known physics, with a port between ports of one kind: laws between two bodies are compared like
    #    all others. What any law explains beside the measurement chain is told by its evidence.
    larger = replace(given, system=with_all_ports_between(system))
    begun = known_physics(larger, progress)
    found = judge(begun.study, begun.fitted, workers, progress)

    # 4. The models that leave have the parts of the chain that pay. Gaps are over windows of the horizon, of
    #    experiments that were left out of the fit, each once.
    #    What makes a gap that matters is an effect, also if it is a usual part of the chain.
    progress("fit the models without the parts of the chain that do not pay")
    every = replace(given, held_out=tuple(range(len(logs))))
    used = _with_used_ports(system, found)
    models = models_of(found, used, every)
    if models.laws < len(found.laws):
        found = found.until(models.laws)
        used = _with_used_ports(system, found)
        models = models_of(found, used, every)
    #    A gap that matters over long windows only, and that nothing explains, is none over the horizon.
    if models.part is not None and not found.laws:
        found = replace(found, verdict="effect")
    elif found.verdict == "unknown" and not models.augmented.matters:
        found = replace(found, verdict="no_gap")
    return Judged(replace(begun.study, system=used), found, models, every)


def judged(
    given: Study, workers: int, progress: Callable[[str], None], faults: Sequence[LogFault] = ()
) -> Diagnosis:
    """Return the diagnosis by the evidence of the logs."""
    one, known = judged_models(given, workers, progress), given.system.port_names
    models = one.models

    # 5. A network in every port of the known physics is the reference where something is left. In two ports
    #    it can do what one between them does.
    if not one.names_all:
        progress("fit a network in every port")
        network = fit_network(one.found.looks[0].parent.base.physics, given.seed, known)
        models = replace(models, neural=_network(network, one.every))
    between = tuple(name for name in one.study.system.port_names if name not in known)
    return assembled(Answered(one.study, one.found, models, between), tuple(faults))


def _with_used_ports(system: System, found: Judgement) -> System:
    """The system with the inputs of the judged one, and those ports between others at which laws act."""
    inputs = found.final.fitted.hypothesis.study.system.inputs
    names = [law.speaker.added.place.name for law in found.laws if law.speaker.added.place.kind == "port"]
    return with_named_ports(replace(system, inputs=inputs), names)


def _network(fitted: FittedHypothesis, every: Study) -> JudgedModel:
    """Judge a network, experiments left out as for the others."""
    study = replace(every, system=fitted.hypothesis.study.system)
    leaves = replace(fitted, hypothesis=replace(fitted.hypothesis, study=study))
    return LastFit(fitted, 1.0).left_out_of(judged_model("neural", leaves))
