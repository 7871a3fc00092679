"""A diagnosis by evidence: the judge names laws, and the models that leave are fitted and assessed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from unmodelled.diagnosis.answer.judged_answer import Answered, Models, assembled
from unmodelled.diagnosis.answer.judged_fits import LastFits, laws_of
from unmodelled.diagnosis.data.duplicates import different
from unmodelled.diagnosis.data.result import Diagnosis, LogFault
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.data.thresholds import DEFAULT_THRESHOLDS, Thresholds
from unmodelled.diagnosis.fitting.judged_models import known_model
from unmodelled.diagnosis.judge.judgement import judge
from unmodelled.diagnosis.search.input_hold import begun
from unmodelled.diagnosis.where.opposite import comparable_ports, with_ports_between
from unmodelled.effects.effect import Effect
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

#: Pairs of ports up to which a port is added between all of them.
MOST_BETWEEN = 3


def diagnose_by_evidence(
    system: System,
    logs: Logs,
    horizon: float,
    seed: int,
    workers: int,
    progress: Callable[[str], None],
    faults: Sequence[LogFault] = (),
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
    laws: Sequence[Effect] = (),
) -> Diagnosis:
    """Name the laws for which the evidence of the logs stands, beside the chain that every log has.

    No experiment is held out before: each is left out once, and the gaps are those of experiments left out.
    """
    logs = different(logs)
    given = Study(system, logs, horizon, (), thresholds, seed, tuple(laws))

    # 3. The known physics, with a port between ports of one kind: laws between two bodies are compared like
    #    all others. What any law explains beside the measurement chain is told by its evidence.
    larger, between = _with_ports_between(system)
    search = begun(replace(given, system=larger), workers, progress)
    found = judge(search.study, search.base, progress)

    # 4. The models that leave have the parts of the chain that pay, and no deviations of experiments.
    progress("fit the models without the parts of the chain that do not pay")
    fits = LastFits.of(found)

    # 5. Gaps over windows of the horizon, every experiment left out of the fit once.
    progress("judge the models on all experiments")
    models = _models(fits, replace(given, held_out=tuple(range(len(logs)))))
    return assembled(Answered(search.study, found, fits, models, between), tuple(faults))


def _with_ports_between(system: System) -> tuple[System, tuple[str, ...]]:
    """The system with a port between all ports of one kind where these are few, and the new names."""
    pairs = comparable_ports(system)
    return with_ports_between(system, pairs) if len(pairs) <= MOST_BETWEEN else (system, ())


def _models(fits: LastFits, every: Study) -> Models:
    """Judge the models; parts of the chain alone leave only if the gap is smaller with them."""
    given, before = known_model(every), fits.reidentified.judged("re-identified", every)
    laws = [law for step in fits.steps[-1:] for law in laws_of(step.fitted)]
    labels = [f"with {law.family} at {law.place.channel}" for law in laws]
    after = [fit.judged(label, every) for fit, label in zip(fits.steps, labels, strict=True)]
    if after:
        return Models(given, (before, *after), after[-1], fits.steps[-1])
    if fits.chained is not None:
        chained = fits.chained.judged("with the measurement chain", every)
        if chained.gap.value < before.gap.value:
            return Models(given, (before,), chained, fits.chained)
    return Models(given, (before,), before, fits.reidentified)
