"""A diagnosis by search: the simplest set of laws that no other one predicts better than.

Why a law was named: `search/candidates.py` compares what was fitted, `Candidates.named` takes the simplest
hypothesis that no other one beats, and `beats` is the only measure of "better".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from unmodelled.diagnosis.answer.assembled import assembled, steps_to
from unmodelled.diagnosis.answer.confirmed import confirmed, small_effects
from unmodelled.diagnosis.data.result import Diagnosis, LogFault
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.decide.decision import decide
from unmodelled.diagnosis.fitting.judged_models import judged_model, known_model


def diagnose_by_search(
    given: Study, workers: int, progress: Callable[[str], None], faults: tuple[LogFault, ...]
) -> Diagnosis:
    """Name the laws that predict experiments best which were left out.

    A share of the experiments is held out from fitting and choosing; gaps are computed on these.
    """
    study = Study.of(given.system, given.logs, given.horizon, given.seed, given.thresholds, given.laws)

    # 3. Refit the known physics by free runs (Bock 1987). Rank everything that could be wrong as columns of
    #    one linear system around the fit, and fit the best for real. Better is what predicts experiments that
    #    were left out (Vehtari, Gelman and Gabry 2017). Go on around what is named.
    # 4. What explains next to nothing of the gap of all experiments is no effect. Experiments that took no
    #    part in any of this strike no law; they lower the verdict if their error does not fall.
    named = confirmed(study, workers, progress)
    search, chosen = named.search, named.chosen

    # 5. Is it all? A network in every port knows no law: if it predicts further, or what is left is no noise,
    #    more is missing.
    steps = steps_to(search, chosen)
    models = [judged_model(f"with {e.family} at {e.place.channel}", fitted) for e, fitted in steps]
    network, flexible = search.beside_network(chosen)
    models = [known_model(study), named.reidentified, *models, judged_model("neural", network)]

    # 6. The verdict, what cannot be told from what is named, and how often such answers are right.
    candidates = search.candidates
    number, best = (candidates.fits.index(fitted) for fitted in (chosen, named.best))
    decision = decide(candidates, number, flexible, models[-2].gap, models[1].gap, best)
    found = assembled(search, decision, models, [effect for effect, _ in steps], faults, given.seed)
    said = [effect for each in found.effects for effect in (each.added, *each.indistinguishable)]
    return replace(found, notes=(*found.notes, *named.notes, *small_effects(named.small, said)))
