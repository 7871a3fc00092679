"""Studies of pendulums whose faults are known, and fits of them."""

from __future__ import annotations

from pathlib import Path

from tests.diagnosis.benches import Bench, pendulum
from unmodelled.diagnosis.data.study import Study
from unmodelled.diagnosis.fitting.hypothesis import FittedHypothesis, Hypothesis
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place

HORIZON = 0.1
JOINT, TORQUE, ANGLE = Place("port", "joint"), Place("actuator", "torque"), Place("sensor", "theta")


#: A bench with one fault, its family and its place, by name.
ONE_FAULT = {
    "friction": (Bench(samples=400), "coulomb_friction", JOINT),
    "dead zone": (Bench(samples=400, friction=0.0, dead_zone=0.05), "actuator_dead_zone", TORQUE),
    "gain": (Bench(samples=400, friction=0.0, gain=1.1), "sensor_gain", ANGLE),
    # a delay of the only input is the same thing
    "delay": (Bench(samples=400, friction=0.0, delay=8), "input_delay", TORQUE),
}


def study(folder: Path, bench: Bench, *changes: tuple[str, str], seed: int = 0) -> Study:
    """Of what the bench logs, by somebody who knows `benches.TEXT` with changes."""
    system = pendulum(folder, *changes)
    return Study.of(system, bench.logs(folder / "logs", system), HORIZON, seed)


def effect(family: str, variant: str = "") -> Effect:
    """Of the library."""
    (found,) = (e for e in effects() if (e.family, e.variant) == (family, variant))
    return found


def fitted(hypothesis: Hypothesis) -> FittedHypothesis:
    """To all windows of the experiments that are learned from."""
    return FittedHypothesis.of(hypothesis, hypothesis.study.recording)
