"""The diagnosis of this project."""

from __future__ import annotations

from benchmarks.head_to_head.method import Model
from unmodelled.api.diagnosis import Answer
from unmodelled.diagnosis.answer.findings import findings
from unmodelled.diagnosis.data.study import Study


class Ours:
    """`unmodelled.diagnose` with one thread, its default horizon and the seed of the study."""

    name, needs = "ours", ()

    def fit(self, study: Study) -> Model:
        answer = Answer(findings(study.system, study.logs, study.horizon, study.seed, workers=1))
        diagnosis = answer.findings.diagnosis
        laws = [f"{e.family} {e.law} at {e.port}" for e in answer.effects]
        says = f"{answer.verdict}: " + ("; ".join(laws) or "no effect named")
        numbers = {row["name"]: float(row["identified"]) for _, row in answer.parameters.iterrows()}
        augmented = diagnosis.augmented
        budget = f"confidence {answer.confidence:.2f}"
        entries = answer.findings.content["effects"]
        named = tuple((e["family"], e["port"]) for e in entries)
        alike = tuple((o["family"], o["port"]) for e in entries for o in e["indistinguishable"])
        return Model(
            augmented.system,
            augmented.logs,
            says,
            numbers,
            budget=budget,
            named=named,
            alike=alike,
            answer=answer,
        )
