"""Studies of pendulums whose faults are known, and fits of them."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import pytest

from tests.diagnosis.benches import FRICTION, Bench
from unmodelled.diagnosis.answer.diagnose import diagnose_gap
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.data.result import Diagnosis, JudgedModel
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.diagnosis.fitting.unknowns import Unknown
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales
from unmodelled.logs.logs import Logs
from unmodelled.systems.model import System

HORIZON = 0.1
JOINT, TORQUE, ANGLE = Place("port", "joint"), Place("actuator", "torque"), Place("sensor", "theta")
#: What is not known of the pendulum with friction.
B, MGL, F_C = Unknown("b", 0.0, 0.1, 0.03), Unknown("mgl", 0.2, 5.0, 0.9), Unknown("F_c", 0.0, 1.0, 0.05)


def study(folder: Path, bench: Bench, *changes: tuple[str, str]) -> Study:
    """Of what the bench logs, by somebody who knows `benches.TEXT` with changes."""
    return Study.of(*bench.recorded(folder, *changes), HORIZON, 0)


@cache
def diagnosed(folder: Path, bench: Bench) -> Diagnosis:
    """The diagnosis of what the bench logs, made once a folder."""
    return diagnose_gap(*bench.recorded(folder), HORIZON, 0, 1)


def shared_study(bench: Bench, *changes: tuple[str, str]) -> Callable[[pytest.TempPathFactory], Study]:
    """A fixture: the study that the tests of a module share."""

    @pytest.fixture(scope="module")
    def shared(tmp_path_factory: pytest.TempPathFactory) -> Study:
        return study(tmp_path_factory.mktemp("study"), bench, *changes)

    return shared


def effect(family: str, variant: str = "") -> Effect:
    (found,) = (e for e in effects() if (e.family, e.variant) == (family, variant))
    return found


def scales_of(system: System, logs: Logs) -> Scales:
    return Scales.measured(system, logs.period, logs.offsets, logs.t, logs.x, logs.u, logs.c)


def judged(label: str, system: System, logs: Logs, runs: Sequence[int] | None = None) -> JudgedModel:
    """The model with its gap in some experiments, default: all."""
    return JudgedModel(label, system, logs, free_runs(system, logs, HORIZON, runs))


def fitted(hypothesis: Hypothesis) -> FittedHypothesis:
    """To all windows of the experiments that are learned from."""
    return FittedHypothesis.of(hypothesis, hypothesis.study.recording)


def simulation_of(folder: Path, bench: Bench, *changes: tuple[str, str]) -> Simulation:
    """The pendulum with friction and other changes of its file, on logs of the bench."""
    system, logs = bench.recorded(folder, *FRICTION, *changes)
    return Simulation(system, Recording.of(logs, HORIZON))
