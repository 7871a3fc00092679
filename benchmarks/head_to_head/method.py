"""The protocol of the methods, and the gap by which all of them are judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Protocol

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """The result of a method.

    Attributes:
        system: system with the numbers and laws that the method found.
        logs: logs of all experiments with the constants of `system`.
        says: sentence on what the method says is wrong with the known physics.
        numbers: values of the uncertain parameters of the system file by name, SI.
        at_bound: names of fitted numbers that ended at a bound; default none.
        budget: effort of the optimiser (iterations, simulations) and its reason to stop; default "".
        laws: laws that the method added, by port; default none.
        joints: numbers that the method gives the joints, by port and quantity (armature, damping,
            frictionloss, stiffness), SI; default none.
        links: mass, centre of mass, axes and principal inertias of links by body, SI; default none.
            The equations of `system` do not have them: the gap of such a model is that in MuJoCo.
        named: family and channel of every effect that the method names, or for which it fits a number.
        alike: family and channel of effects that it lists as indistinguishable from these; default none.
        answer: answer of the diagnosis, for `ours` only.
    """

    system: System
    logs: Logs
    says: str
    numbers: Mapping[str, float]
    at_bound: tuple[str, ...] = ()
    budget: str = ""
    laws: Mapping[str, sp.Expr] = field(default_factory=dict)
    joints: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    links: Mapping[str, tuple[Array, ...]] = field(default_factory=dict)
    named: tuple[tuple[str, str], ...] = ()
    alike: tuple[tuple[str, str], ...] = ()
    answer: object = None


class Method(Protocol):
    """A method that fits a model to the training experiments of a study."""

    #: Name in tables.
    name: str
    #: Packages that it needs, as pip names them.
    needs: tuple[str, ...]

    def fit(self, study: Study) -> Model:
        """Fit the model; the held-out experiments of the study take no part.

        Args:
            study: known physics, logs and held-out experiments.
        """


def gap_of(model: Model, study: Study, learned: bool = False) -> float:
    """Return the gap of a model in the project's free runs, in standard deviations of the outputs.

    Args:
        model: fitted model.
        study: known physics, logs and held-out experiments.
        learned: whether the gap is that on the training experiments; default False: on the held-out ones.
    """
    runs = study.learned if learned else study.held_out
    logs = prepare(model.system, model.logs)
    return free_runs(model.system, logs, study.horizon, runs, study.sensors).value


def with_values(
    hypothesis: Hypothesis,
    values: Mapping[str, float],
    own: Mapping[str, Mapping[str, float]],
    substeps: int,
) -> tuple[System, Logs]:
    """Return a hypothesis as a system with given numbers, and the logs with its constants.

    Numbers that every experiment has for itself, such as the start of a hidden state, are fitted to the first
    half of held-out experiments, as the diagnosis does it.

    Args:
        hypothesis: the known physics with effects.
        values: values by name of the unknown, SI; a timing that is missing is zero.
        own: values of single experiments by name and id, SI.
        substeps: integration steps per sample.
    """
    every = {**dict.fromkeys(hypothesis.timing, 0.0), **values}
    found = SimpleNamespace(values=every, own=own, substeps=substeps)
    fitted = SimpleNamespace(hypothesis=hypothesis, fit=found)
    judged = judged_model("", fitted)  # type: ignore[arg-type]
    return judged.system, judged.logs


def uncertain(system: System) -> dict[str, float]:
    """Return the values of the uncertain parameters that all experiments share, by name, SI.

    Args:
        system: system with its numbers.
    """
    given = dict(zip((p.name for p in system.parameters), system.values, strict=True))
    return {name: given[name] for name in system.uncertain}
