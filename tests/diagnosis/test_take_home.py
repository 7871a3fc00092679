"""Robot files of an answer: what they say moves in MuJoCo as the augmented system does."""

from dataclasses import replace
from itertools import islice
from pathlib import Path

import mujoco
import numpy as np
import pytest

from tests.diagnosis.studies import effect
from tests.every import every
from tests.physics.effects.benches import SYSTEMS, arm, arm_scales, measured
from tests.physics.robot.mechanisms import OFF, system_of
from unmodelled.base.errors import BadInput
from unmodelled.diagnosis.answer.take_home import TakeHome, take_home
from unmodelled.diagnosis.data.result import DiagnosedEffect, Estimate
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales
from unmodelled.engine.machine.program import Program
from unmodelled.systems.model import System
from unmodelled.systems.syntax import names


def found(added: Added, values: dict[str, float]) -> DiagnosedEffect:
    estimates = {n: Estimate(added.units[n], np.nan, v, (v, v)) for n, v in values.items()}
    return DiagnosedEffect(added, estimates, {}, 0.9, 0.8, (0.7, 0.9), ())


def planted(
    effect: Effect, place: Place, system: System, sizes: Scales | None = None
) -> tuple[System, DiagnosedEffect]:
    """An effect with plausible numbers."""
    added = effect.add(system, place, sizes or arm_scales())
    values = {n: 1.0 if n in added.shares else 0.5 * added.scales[n] for n in added.amplitudes}
    values |= {n: added.scales[n] for n in added.shapes}
    return with_numbers(added.system, [added], values), found(added, values)


def difference(home: TakeHome, system: System) -> float:
    """Of the accelerations in MuJoCo from those of a system, at fast motions, relative to the largest."""
    model = mujoco.MjModel.from_xml_string(home.text)
    model.opt.disableflags |= int(OFF)
    forces, data = home.supplement.complete(model), mujoco.MjData(model)
    joints = [model.joint(k).name for k in range(model.njnt)]
    order = [joints.index(port) for port in arm().port_names]
    program = Program.of(system, system.dynamics)
    rng, off, largest = np.random.default_rng(1), 0.0, 0.0
    mujoco.set_mjcb_passive(forces)
    for _ in range(6):
        q, qd = rng.normal(size=3), rng.choice([-1.0, 1.0], 3) * rng.uniform(2.0, 4.0, 3)
        u = rng.normal(size=3)
        beside = rng.normal(size=len(system.states) - 6)
        x = np.concatenate([q[order], qd[order], beside])
        wanted = program.evaluate(np.zeros(()), x, u, np.array(system.values), np.zeros(len(system.c)))
        data.qpos[:], data.qvel[:], data.ctrl[:], data.time = q, qd, u, 0.0
        data.act[:] = beside[: len(data.act)]
        own = dict(zip((s.name for s in system.states[6:]), beside, strict=True))
        forces.begin(0.0, np.array([own[name] for name in home.supplement.rates]))
        mujoco.mj_forward(model, data)
        off = max(off, float(np.max(np.abs(data.qacc[order] - wanted[3:6]))))
        largest = max(largest, float(np.max(np.abs(wanted[3:6]))))
    mujoco.set_mjcb_passive(None)
    return off / largest


def lacking(home: TakeHome) -> list[str]:
    """What neither the file nor the supplement holds."""
    return [part.what for part in home.missing if not part.supplemented]


@every(effects)
def test_the_patched_file_moves_as_the_arm_with_an_effect_or_says_what_it_lacks(law: Effect) -> None:
    for place in islice(reversed(law.places(arm())), 2):
        system, found = planted(law, place, arm())
        home = take_home(arm(), system, [found])
        added = found.added
        elsewhere = place.kind in ("sensor", "parameter")
        unsaid = added.memory and place.kind == "actuator" and not added.robot
        if elsewhere or unsaid or added.delays or added.columns or added.per_experiment:
            assert lacking(home) == [added.title]
        elif added.memory and any(part.reason.startswith("it depends on") for part in home.missing):
            assert lacking(home)[0] == added.title  # the acceleration moves what it remembers by
        else:
            assert not lacking(home)
            assert difference(home, system) < 1e-9


def place_of(law: Effect, name: str) -> Place:
    return next(place for place in law.places(arm()) if place.name == name)


SAID = {
    ("coulomb_friction", "elbow"): {"frictionloss"},
    ("viscous_friction", "elbow"): {"damping"},
    ("inertia_error", "elbow"): {"armature"},
    ("linear_spring", "elbow"): {"stiffness"},
    ("actuator_gain", "u_shoulder"): {"gear", "ctrl_low", "ctrl_high"},
    ("actuator_saturation", "u_shoulder"): {"ctrl_low", "ctrl_high"},
    ("actuator_lag", "u_shoulder"): {"timeconst"},
}


@pytest.mark.parametrize(("said", "quantities"), SAID.items())
def test_effects_that_mjcf_can_say_are_attributes(said: tuple[str, str], quantities: set[str]) -> None:
    family, at = said
    law = effect(family)
    place = place_of(law, at)
    system, found = planted(law, place, arm())
    home = take_home(arm(), system, [found])
    changed = {c.quantity for c in home.changes if c.element == place.name.removeprefix("u_")}
    # the file had dry friction at the elbow, which is what the diagnosis finds and no more
    assert changed - {"frictionloss"} == quantities - {"frictionloss"}
    assert not home.supplement and not home.missing


def test_several_effects_at_one_actuator_and_joint_are_said_together() -> None:
    wanted = {
        "u_shoulder": ("actuator_saturation", "actuator_gain", "actuator_offset"),
        "u_elbow": ("actuator_gain", "actuator_saturation"),
        "u_waist": ("actuator_gain", "actuator_dead_zone"),
        "elbow": ("inertia_error", "viscous_friction", "quadratic_drag"),
        "shoulder": ("load_friction",),
    }
    system, found = arm(), []
    for at, family in ((at, family) for at, families in wanted.items() for family in families):
        system, one = planted(effect(family), place_of(effect(family), at), system)
        found.append(one)
    home = take_home(arm(), system, found[::-1])
    assert {c.quantity for c in home.changes if c.element == "elbow"} >= {"armature", "damping", "ctrl_high"}
    assert home.supplement.numbers.keys() == {"elbow", "shoulder"}
    # the gain acts on what is beyond the dead zone: both are one force
    assert home.supplement.forces.keys() == {"waist", "elbow", "shoulder"}
    assert not lacking(home)
    assert difference(home, system) < 1e-9


def test_identified_numbers_are_in_the_file() -> None:
    system = arm().with_values({"elbow_armature": 0.013, "waist_damping": 0.06})
    home = take_home(arm(), system, [])
    changed = {(c.element, c.quantity): c.patched for c in home.changes}
    expected = {("elbow", "armature"): 0.013, ("waist", "damping"): 0.06, ("elbow", "frictionloss"): 0.0}
    assert changed == expected
    assert difference(home, system) < 1e-9


def test_an_effect_that_no_file_holds_names_one_that_a_file_could_hold_instead() -> None:
    part, inertia = effect("flexible_transmission", "part"), effect("inertia_error")
    place = place_of(part, "elbow")
    system, found = planted(part, place, arm())
    alike = replace(found, indistinguishable=(inertia.add(arm(), place, arm_scales()),))
    missing, further = take_home(arm(), system, [alike]).missing
    assert not missing.supplemented and "depends on an acceleration" in further.reason
    told = "cannot tell it from inertia error at elbow, which a robot has a number for"
    assert missing.reason.endswith(told)


DRIVEN = """inputs: {u_waist: {}, u_shoulder: {}, i: {unit: A, commanded: false}}
signals: {drive_elbow: k*i + 0.1}
parameters: {k: {value: 2.5, unit: N m/A}}
ports: {elbow: {law: 0.04*sign(qd_elbow)}}
"""


def test_a_drive_of_the_system_file_is_an_effort_that_is_applied(tmp_path: Path) -> None:
    given = system_of(tmp_path, (SYSTEMS / "arm.xml").read_text(), DRIVEN)
    gain, friction = effect("actuator_gain"), effect("load_friction")
    system, first = planted(gain, Place("actuator", "i"), given, measured(given))
    system, second = planted(friction, Place("port", "elbow"), system, measured(system))
    home = take_home(given, system, [first, second])
    assert home.efforts.controls == {"waist": ("u_waist",), "shoulder": ("u_shoulder",)}
    assert lacking(home) == ["actuator gain at input i"]
    assert "the law of the port elbow in the system file" in [m.what for m in home.missing]
    law = home.supplement.forces["elbow"]
    assert "abs(applied_elbow)" in law and "sign(qd_elbow)" in law and "i" not in names(law)


def test_dynamics_that_are_not_those_of_the_file_are_refused_in_one_line(tmp_path: Path) -> None:
    other = "dynamics: {qd_elbow: -9.81*q_elbow/1.0}\n"
    given = system_of(tmp_path, (SYSTEMS / "arm.xml").read_text(), other)
    with pytest.raises(BadInput, match=r"dynamics\.qd_elbow is not the acceleration of the robot file"):
        take_home(given, given, [])
