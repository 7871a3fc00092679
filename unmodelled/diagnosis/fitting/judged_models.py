"""Models with their fitted numbers, judged on the held-out experiments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from unmodelled.diagnosis.data.gap import Gap
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import JudgedModel
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.fit import fit_parameters
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.effects.added import with_numbers
from unmodelled.effects.columns import extended, in_columns
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare, with_delays
from unmodelled.systems.model import System

Array = NDArray[np.float64]

#: Share of a held-out experiment to which its own numbers are fitted.
SEEN = 0.5


def known_model(study: Study) -> JudgedModel:
    """Return the system as given, with its gap on the held-out experiments.

    Args:
        study: inputs of the diagnosis.
    """
    return JudgedModel("known", study.system, study.logs, held_out_gap(study.system, study.logs, study))


def judged_model(label: str, fitted: FittedHypothesis) -> JudgedModel:
    """Return a hypothesis as a system with its fitted numbers, and its gap on the held-out experiments.

    Args:
        label: name of the model.
        fitted: fitted hypothesis.
    """
    study, effects = fitted.hypothesis.study, fitted.hypothesis.effects
    system = with_fitted(fitted.hypothesis, fitted.fit.values)
    logs = study.logs
    for effect in effects:
        logs = extended(logs, effect.columns)
    own = values_per_experiment(fitted)
    if own:
        system = in_columns(system, own)
        logs = extended(logs, {n: np.array([values[i] for i in logs.ids]) for n, values in own.items()})
    logs = prepare(system, logs)
    return JudgedModel(label, system, logs, held_out_gap(system, logs, study))


def held_out_gap(system: System, logs: Logs, study: Study) -> Gap:
    """Return the gap of `system` on the held-out experiments of `study`.

    Args:
        system: system with its numbers.
        logs: logs of all experiments, with the states and constants of `system`.
        study: inputs of the diagnosis.
    """
    return free_runs(system, logs, study.horizon, study.held_out, study.sensors)


def values_per_experiment(fitted: FittedHypothesis) -> dict[str, dict[str, float]]:
    """Return the numbers that every experiment has for itself, by name and id, SI.

    Those of held-out experiments are fitted to the first half of these experiments, with all shared numbers
    fixed: nothing else determines them, and the second half stays unseen.

    Args:
        fitted: fitted hypothesis.
    """
    if not fitted.fit.own:
        return {}
    study, system = fitted.hypothesis.study, with_fitted(fitted.hypothesis, fitted.fit.values)
    unknowns = [u for u in fitted.hypothesis.unknowns if u.own]
    logs = with_delays(system, study.logs)
    held = Recording.of(logs, study.horizon, study.held_out, study.latest, study.sensors).begun(SEEN)
    found = fit_parameters(
        Simulation(system, held, c=fitted.hypothesis.c), unknowns, substeps=fitted.fit.substeps
    ).own
    return {name: {**values, **found[name]} for name, values in fitted.fit.own.items()}


def with_fitted(hypothesis: Hypothesis, values: Mapping[str, float]) -> System:
    """Return the system of a hypothesis with given numbers, delays and the timing of its inputs.

    Args:
        hypothesis: the known physics with effects.
        values: values by name of the unknown, SI; the timing of every input must be among them.
    """
    system = with_numbers(hypothesis.full, hypothesis.effects, values)
    late = {u: values[name] for name, u in hypothesis.timing.items()}
    inputs = (replace(i, delay=i.delay + late.get(i.name, 0.0)) for i in system.inputs)
    return replace(system, inputs=tuple(inputs))
