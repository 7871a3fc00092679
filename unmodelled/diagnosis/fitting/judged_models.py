"""Models with their fitted numbers, judged of experiments left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from unmodelled.diagnosis.data.gap import Gap
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.own_numbers import with_own_numbers
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.effects.added import with_numbers
from unmodelled.effects.columns import extended, in_columns
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import Constant, System


def known_model(study: Study) -> JudgedModel:
    """Return the system as given, with its gap of experiments left out."""
    return JudgedModel("known", study.system, study.logs, held_out_gap(study.system, study.logs, study))


def judged_model(label: str, fitted: FittedHypothesis) -> JudgedModel:
    """Return a hypothesis as a system with its fitted numbers, and its gap of experiments left out."""
    system, logs = _numbered(fitted)
    return JudgedModel(label, system, logs, held_out_gap(system, logs, fitted.hypothesis.study))


def held_out_gap(system: System, logs: Logs, study: Study) -> Gap:
    """Return the gap of `system` of experiments left out of `study`."""
    return free_runs(system, logs, study.horizon, study.held_out, study.sensors)


def values_per_experiment(fitted: FittedHypothesis) -> dict[str, dict[str, float]]:
    """Return the numbers that every experiment has for itself, by name and id, SI.

    Those of held-out experiments are fitted to the first half of these experiments, see `with_own_numbers`.
    """
    if not fitted.fit.own:
        return {}
    _, logs = _numbered(fitted)
    table = logs.experiments
    return {name: dict(zip(logs.ids, table[name].tolist(), strict=True)) for name in fitted.fit.own}


def _numbered(fitted: FittedHypothesis) -> tuple[System, Logs]:
    """The system with the fitted numbers, and the logs with the constants that it needs."""
    study, system = fitted.hypothesis.study, with_fitted(fitted.hypothesis, fitted.fit.values)
    logs = study.logs
    for effect in fitted.hypothesis.effects:
        logs = extended(logs, effect.columns)
    own = [_own_number(u, system, fitted.fit.own[u.name]) for u in fitted.hypothesis.unknowns if u.own]
    system = in_columns(system, own)
    logs = extended(logs, {c.name: np.array([c.value(i) for i in logs.ids]) for c in own})
    logs = prepare(system, logs)
    return system, with_own_numbers(system, logs, study.horizon, study.held_out, study.sensors)


def _own_number(unknown: Unknown, system: System, values: Mapping[str, float]) -> Constant:
    """The constant of a number that differs between experiments; one that is not fitted has their mean."""
    (unit,) = (p.unit for p in system.parameters if p.name == unknown.name)
    mean = float(np.mean(list(values.values())))
    bounds = (unknown.low, unknown.high) if np.isfinite([unknown.low, unknown.high]).all() else None
    return Constant(unknown.name, unit, values, mean, identify=True, bounds=bounds)


def with_fitted(hypothesis: Hypothesis, values: Mapping[str, float]) -> System:
    """Return the system of a hypothesis with given numbers, delays and the timing of its inputs."""
    system = with_numbers(hypothesis.full, hypothesis.effects, values)
    late = {u: values[name] for name, u in hypothesis.timing.items()}
    inputs = (replace(i, delay=i.delay + late.get(i.name, 0.0)) for i in system.inputs)
    return replace(system, inputs=tuple(inputs))
