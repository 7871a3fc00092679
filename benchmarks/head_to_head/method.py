"""The protocol of the methods, and the gap by which all of them are judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Protocol

import sympy as sp

from unmodelled.base.arrays import Array
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.hypothesis import Hypothesis
from unmodelled.diagnosis.fitting.judged_models import judged_model
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import System


@dataclass(frozen=True)
class Model:
    """The result of a method."""

    system: System  # with the numbers and laws that the method found
    logs: Logs  # of all experiments, with the constants of `system`
    says: str  # what is wrong with the known physics, by the method
    numbers: Mapping[str, float]  # uncertain parameters of the system file, SI
    at_bound: tuple[str, ...] = ()  # fitted numbers that ended at a bound
    budget: str = ""  # iterations and simulations of the optimiser, and its reason to stop
    laws: Mapping[str, sp.Expr] = field(default_factory=dict)  # that the method added, by port
    #: By port and quantity (armature, damping, frictionloss, stiffness), SI.
    joints: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    #: Mass, centre of mass, axes and principal inertias by body, SI, in MuJoCo only, not in `system`.
    links: Mapping[str, tuple[Array, ...]] = field(default_factory=dict)
    #: Family and channel of effects that it names, or fits a number for.
    named: tuple[tuple[str, str], ...] = ()
    alike: tuple[tuple[str, str], ...] = ()  # effects that it lists as indistinguishable from these
    answer: object = None  # of the diagnosis, for `ours` only


class Method(Protocol):
    """A method that fits a model to the training experiments of a study."""

    #: Name in tables.
    name: str
    #: Packages that it needs, as pip names them.
    needs: tuple[str, ...]

    def fit(self, study: Study) -> Model:
        """Fit the model; the held-out experiments of the study take no part."""


def gap_of(model: Model, study: Study, learned: bool = False) -> float:
    """Return the gap of a model in the project's free runs, in standard deviations of the outputs.

    It is that on the training experiments if `learned`, else on the held-out ones.
    """
    runs = study.learned if learned else study.held_out
    logs = prepare(model.system, model.logs)
    return free_runs(model.system, logs, study.horizon, runs, study.sensors).value


def with_values(
    hypothesis: Hypothesis, values: Mapping[str, float], own: Mapping[str, Mapping[str, float]], substeps: int
) -> tuple[System, Logs]:
    """Return a hypothesis as a system with given numbers (SI), and the logs with its constants.

    A timing that is missing is zero. Numbers that every experiment has for itself (`own`, by name and id),
    such as the start of a hidden state, are fitted to the first half of held-out experiments, as the
    diagnosis does it.
    """
    every = {**dict.fromkeys(hypothesis.timing, 0.0), **values}
    found = SimpleNamespace(values=every, own=own, substeps=substeps)
    fitted = SimpleNamespace(hypothesis=hypothesis, fit=found)
    judged = judged_model("", fitted)  # type: ignore[arg-type]
    return judged.system, judged.logs


def uncertain(system: System) -> dict[str, float]:
    """Return the values of the uncertain parameters that all experiments share, by name, SI."""
    given = dict(zip((p.name for p in system.parameters), system.values, strict=True))
    return {name: given[name] for name in system.uncertain}
