"""A diagnosis whose laws were compared by evidence: kinds, evidence, measurement chain, strangers."""

from dataclasses import replace

from tests.diagnosis.studies import JOINT, TORQUE, effect, scales_of
from unmodelled.diagnosis.data.result import ChainPart, Diagnosis, Evidence
from unmodelled.effects.added import Added
from unmodelled.effects.place import Place

THETA = Place("sensor", "theta")
NAN = float("nan")


def by_evidence(found: Diagnosis) -> Diagnosis:
    """Return a diagnosis of the pendulum with dry friction with all that a comparison by evidence adds."""

    def at(family: str, place: Place, variant: str = "") -> Added:
        return effect(family, variant).add(found.system, place, scales_of(found.system, found.logs))

    (friction,) = found.effects
    dahl, viscous = at("hysteresis", JOINT, "dahl"), at("viscous_friction", JOINT)
    friction = replace(
        friction,
        confidence=0.96,
        indistinguishable=(dahl, viscous),
        kind="dry friction",
        probabilities=(0.75, 0.23, 0.02),
    )
    chain = (
        ChainPart(at("sensor_delay", THETA), 0.008, 0.0004, "s", False),
        ChainPart(at("input_delay", TORQUE), 0.012, 0.002, "s", False),
        ChainPart(at("actuator_lag", TORQUE), 0.0051, NAN, "s", False),
        ChainPart(at("sensor_gain", THETA), 0.043, 0.0007, "1", False),
        ChainPart(at("sensor_offset", THETA), -0.01, 0.001, "rad", False),
        ChainPart(at("scatter", TORQUE, "gain"), 0.11, NAN, "1", True),
        ChainPart(at("scatter", Place("parameter", "b")), 0.06, 0.01, "1", True),
    )
    others = (("linear_spring", JOINT), ("actuator_gain", TORQUE), ("sensor_gain", THETA))
    laws = (friction.added, dahl, viscous, *(at(family, place) for family, place in others))
    evidence = tuple(
        Evidence(law, horizon, first / (1.0 + k) - 4.0 * k, 0.98 / (1.0 + k))
        for horizon, first in ((0.1, 420.0), (0.4, 165.0))
        for k, law in enumerate(laws)
    )
    failed = Evidence(at("quadratic_drag", JOINT), 0.4, float("-inf"), 0.0)
    shown = replace(found, effects=(friction,), chain=chain, evidence=(*evidence, failed))
    return replace(shown, strangers=(found.logs.ids[1],))
