"""The machines of the withheld check: the known physics without effects, measurably not so with them."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pipeline.rigs.slider_crank import SliderCrankRig
from pipeline.rigs.withheld.campaign import write
from pipeline.rigs.withheld.carriages import Hoist
from pipeline.rigs.withheld.cases import Case, Planted
from pipeline.rigs.withheld.cranks import SliderCrank
from pipeline.rigs.withheld.effects.effect import Plan, Plantable, Port
from pipeline.rigs.withheld.effects.friction import Coulomb
from pipeline.rigs.withheld.effects.loads import LooseInertia
from pipeline.rigs.withheld.experiments import run
from pipeline.rigs.withheld.machine import Machine
from pipeline.rigs.withheld.machines import EVERY, MACHINES
from pipeline.rigs.withheld.pendulum import Pendulum
from pipeline.rigs.withheld.stepping import move
from unmodelled.base.arrays import Array
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

pytestmark = pytest.mark.long

OFFERED = [(machine, one) for machine in EVERY for one in machine.plantable]
NAMED = [f"{machine.name}-{one.family}-{one.channel}" for machine, one in OFFERED]
SEED = 5  # all of these campaigns log everything


def bare(machine: Machine, seed: int = SEED) -> Case:
    return Case(machine.name, (), 1.0, seed)


def short(case: Case, seconds: float = 0.7) -> Plan:
    """The plan of `case`, cut to `seconds`."""
    plan = case.plan()
    return replace(plan, samples=round(seconds / plan.period))


def true_system(folder: Path, truth: Mapping[str, Any]) -> Path:
    """The system file of a case with its true parameters."""
    document = yaml.safe_load((folder / "system.yaml").read_text())
    for name, values in truth["parameters"].items():
        document["parameters"][name]["value"] = values["true"]
    path = folder / "true.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False))
    return path


@pytest.mark.parametrize(
    ("machine", "everything"),
    [
        (machine, everything)
        for machine in EVERY
        for everything in ((True, False) if machine.optional else (True,))
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_without_effects_a_machine_is_its_system_file(
    machine: Machine, everything: bool, tmp_path: Path
) -> None:
    """What remains is the noise that the measured start of a window passes on."""
    whole = len(machine.sensors)
    case = next(c for k in range(50) if (len((c := bare(machine, k)).logged) == whole) == everything)
    truth = write(case, tmp_path / "case", short(case, 1.5))
    system = read_system(true_system(tmp_path / "case", truth))
    logs = read_logs(tmp_path / "case" / "logs", system)
    found = free_runs(system, logs, 0.1)
    assert 0.8 < found.value / found.floor < 1.25
    assert found.substeps == 1


@pytest.fixture(scope="module")
def undisturbed() -> dict[str, dict[str, Array]]:
    return {machine.name: run(bare(machine), short(bare(machine))).exact for machine in EVERY}


@pytest.mark.parametrize(("machine", "one"), OFFERED, ids=NAMED)
def test_every_effect_is_measurable(
    machine: Machine, one: Plantable, undisturbed: dict[str, dict[str, Array]]
) -> None:
    case = Case(machine.name, (Planted(one.family, one.channel),), 1.0, SEED)
    made = run(case, short(case)).exact
    moved = [
        np.max(np.abs(made[s.output] - undisturbed[machine.name][s.output])) / max(s.noise, s.quantum)
        for s in machine.sensors
    ]
    assert np.all(np.isfinite(moved))
    assert max(moved) > 4.0


@pytest.mark.parametrize("machine", EVERY, ids=lambda machine: machine.name)
def test_at_level_zero_all_effects_together_do_nothing(
    machine: Machine, undisturbed: dict[str, dict[str, Array]]
) -> None:
    every = [Planted(one.family, one.channel) for one in machine.plantable]
    # without play an inertia is still a body of its own, which costs some accuracy
    loose = [planted for planted in every if planted.family == "backlash"]
    assert loose or machine not in MACHINES
    for effects, most in (([p for p in every if p not in loose], 0.01), (loose, 1.0)):
        case = Case(machine.name, tuple(effects), 0.0, SEED)
        made = run(case, short(case)).exact
        for sensor in machine.sensors:
            off = np.max(np.abs(made[sensor.output] - undisturbed[machine.name][sensor.output]))
            assert off < most * max(sensor.noise, sensor.quantum), sensor.output


@pytest.mark.parametrize("machine", EVERY, ids=lambda machine: machine.name)
def test_an_effect_grows_with_its_level(machine: Machine, undisturbed: dict[str, dict[str, Array]]) -> None:
    one, name, sizes = machine.plantable[0], machine.sensors[0].output, []
    for level in (0.03, 0.3, 3.0):
        case = Case(machine.name, (Planted(one.family, one.channel),), level, SEED)
        sizes.append(np.std(run(case, short(case)).exact[name] - undisturbed[machine.name][name]))
    assert all(3.0 * low < high for low, high in pairwise(sizes))


def test_dry_friction_sticks_and_takes_power_out() -> None:
    machine, plan = Hoist(), short(bare(Hoist()), 1.0)
    reference = 0.5 + 0.1 * np.minimum(0.6, plan.period * np.arange(plan.samples))
    still = np.full((1, plan.runs), 0.5)
    motion = move(machine, plan, np.tile(reference[:, None], plan.runs), still, [("rail", Coulomb(40.0))], [])
    stuck = np.abs(motion.v[:, 0]) < 1e-12
    assert np.all(stuck[:5])
    assert np.all(stuck[-20:])
    assert 0.3 < np.mean(~stuck) < 0.9
    free = move(machine, plan, np.tile(reference[:, None], plan.runs), still, [], [])
    assert np.max(np.abs(free.q[-1, 0] - 0.56)) < 0.2 * np.min(np.abs(motion.q[-1, 0] - 0.56))


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_loose_inertia_stays_in_its_play_and_keeps_the_momentum(restitution: float) -> None:
    free = replace(Pendulum(), J=0.012, b=0.0, mgl=0.0)
    plan = short(bare(Pendulum()), 1.0)
    t = plan.period * np.arange(plan.samples)
    torque = np.tile(0.1 * np.sin(20.0 * t)[:, None], plan.runs)
    momentum = [np.zeros(plan.runs)]
    widest = [0.0]

    class Watched(LooseInertia):
        def impulse(self, dt: float, t: float, port: Port) -> Array:
            passed = super().impulse(dt, t, port)
            assert self._body is not None
            widest.append(float(np.max(np.abs(self._body[0] - port.position))))
            momentum.append(self.inertia * self._body[1])
            return passed

    watched = Watched("J", 0.008, 0.05, restitution, 0.01)
    motion = move(free, plan, torque, np.zeros((1, plan.runs)), [("joint", watched)], [])
    assert 0.049 < max(widest) < 0.052
    last = plan.samples - 1
    whole = momentum[last * plan.substeps + round(plan.hold * plan.substeps)] + free.J * motion.v[-1, 0]
    given = plan.period * (np.sum(torque[:last, 0]) + plan.hold * torque[last, 0])
    np.testing.assert_allclose(whole, given, atol=1e-9)
    assert np.max(np.abs(motion.v)) > 0.2


class Unloaded(SliderCrank):
    """The reference is the torque itself."""

    def command(self, reference: Array, slope: Array, q: Array, v: Array, c: Mapping[str, Array]) -> Array:
        return reference


def test_slider_crank_moves_as_the_bodies_of_another_engine() -> None:
    names = ("preload", "stiffness", "stiffening", "coulomb", "static", "viscous", "ripple", "ripple_share")
    bodies = replace(SliderCrankRig(), **dict.fromkeys(names, 0.0))

    def torque(t: Array) -> Array:
        return 1.5 * np.sin(12.0 * t)

    true = bodies.simulate(torque, 0.3, 400)
    plan = replace(bare(SliderCrank()).plan(), period=5e-4, samples=400, hold=0.5, begin=np.zeros(1))
    instants = (5e-4 * np.arange(400))[:, None]
    motion = move(Unloaded(), plan, torque(instants + 2.5e-4), np.array([[0.3]]), [], [])
    middle = 0.5 * (true["theta"][1:] + true["theta"][:-1])  # the logger reads in the middle of a period
    assert np.ptp(middle) > 1.0
    np.testing.assert_allclose(motion.q[:-1, 0, 0], middle, atol=0.002)
