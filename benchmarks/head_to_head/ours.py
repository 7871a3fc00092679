"""The diagnosis of this project, and its fit of the uncertain parameters alone."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.head_to_head.method import Model, uncertain
from unmodelled.api.answer import Answer
from unmodelled.diagnosis.answer.diagnose import findings
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.effects.columns import extended
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System


class FileParameters:
    """The uncertain parameters of the system file by this project's least squares, without any effect."""

    name, needs = "re-identified", ()

    def fit(self, study: Study) -> Model:
        fitted = FittedHypothesis.of(Hypothesis.known(study), study.recording)
        judged, known = judged_model(self.name, fitted), uncertain(study.system)
        numbers = {name: float(fitted.fit.values[name]) for name in known}
        moved = [f"{name} {known[name]:.3g} -> {numbers[name]:.3g}" for name in known]
        says = "parameters: " + ("; ".join(moved) or "none is uncertain")
        bounds = tuple(name for name in known if fitted.at_bound(name))
        return Model(judged.system, judged.logs, says, numbers, at_bound=bounds)


class Ours:
    """`unmodelled.diagnose` with one thread, its default horizon and the seed of the study."""

    name, needs = "ours", ()

    def fit(self, study: Study) -> Model:
        found = findings(study.system, study.logs, study.horizon, study.seed, workers=1)
        answer = Answer.of(found)
        laws = [f"{e.family} {e.law} at {e.port}" for e in answer.effects]
        says = f"{answer.verdict}: " + ("; ".join(laws) or "no effect named")
        numbers = {row["name"]: float(row["identified"]) for _, row in answer.parameters.iterrows()}
        budget = f"confidence {answer.confidence:.2f}"
        entries = answer.content["effects"]
        named = tuple((e["family"], e["port"]) for e in entries)
        alike = tuple((o["family"], o["port"]) for e in entries for o in e["indistinguishable"])
        system, logs = _with_all_outputs(found.diagnosis.augmented, study)
        return Model(system, logs, says, numbers, (), budget, named=named, alike=alike, answer=answer)


def _with_all_outputs(augmented: JudgedModel, study: Study) -> tuple[System, Logs]:
    """The augmented system and its logs, with outputs that the diagnosis left out.

    A diagnosis leaves out an output that is computed from another one, such as a differenced speed. The gap
    of the comparison is over all outputs.
    """
    system, logs = augmented.system, augmented.logs
    if logs.outputs == study.logs.outputs:
        return system, logs
    own = {o.name: o for o in system.outputs}
    outputs = tuple(own.get(o.name, o) for o in study.system.outputs)
    known = study.logs.constants
    more = {n: logs.c[:, k] for k, n in enumerate(logs.constants) if n not in known}
    return replace(system, outputs=outputs), extended(study.logs, more)
