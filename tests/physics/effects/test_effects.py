"""Every effect at every kind of place: alone, on top of others, in some experiments only, and on robots."""

import re
from dataclasses import dataclass, replace
from itertools import islice, permutations
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from tests.diagnosis.studies import effect
from tests.every import every
from tests.machines.folders import changed, logs_of, system_of
from tests.machines.known import built_in, values_of, written_again
from tests.physics.effects.benches import (
    PERIOD,
    Case,
    arm,
    arm_scales,
    at_place,
    cases,
    evaluated,
    measured,
    run,
    scales,
    system,
    values,
)
from tests.physics.robot.mechanisms import CART
from tests.physics.robot.mechanisms import system_of as robot_of
from tests.physics.robot.test_motion import rates
from unmodelled.base.errors import BadInput
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.columns import extended, in_columns
from unmodelled.effects.contract import check_effect
from unmodelled.effects.effect import Effect, PortEffect
from unmodelled.effects.law import Amplitude, Law, Shape, signed
from unmodelled.effects.library import effects
from unmodelled.effects.motion import is_inertial
from unmodelled.effects.place import Place, Site
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.logs.readings import readings
from unmodelled.systems.model import Constant, System


def test_no_two_effects_share_family_and_variant_and_basic_laws_come_first() -> None:
    names = [f"{each.family} {each.variant}".strip() for each in effects()]
    assert len(set(names)) == len(names), "give the new effect another variant"
    assert [(each.family, each.variant) for each in effects()] == sorted(
        (e.family, e.variant) for e in effects()
    )


def test_every_effect_is_tried_somewhere() -> None:
    untried = set(effects()) - {case.effect for case in cases()}
    assert not untried, f"{untried}: no system has a place for it: add one to FILES of benches.py"


def test_no_drive_lies_between_a_measured_input_and_the_physics() -> None:
    known = system("pendulum")
    item = replace(known.inputs[0], commanded=False)
    families = {e.family for e in effects() if e.places(replace(known, inputs=(item,)))}
    drives = {"actuator_saturation", "actuator_dead_zone", "actuator_lag", "actuator_rate_limit"}
    assert not families & drives
    assert families >= {"actuator_gain", "actuator_offset", "input_delay"}


@every(cases)
def test_every_effect_keeps_what_all_must_keep(case: Case) -> None:
    added = check_effect(case.effect, case.system, case.place, scales(case.name))
    fitted = [*added.amplitudes, *added.shapes]
    left_out = {name for name in fitted if name.startswith("v_c")} | {*added.shares}
    assert set(added.reported) == set(fitted) - left_out


@dataclass(frozen=True)
class Broken(PortEffect):
    """A law that breaks a rule."""

    made: Law
    family: str = "broken"

    def law(self, at: Site) -> Law:
        return self.made


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (Law("k", {"k": Amplitude("1", 1.0, (0.5, 2.0))}), "k: its starting values are out of its bounds"),
        (Law("k", {"k": Amplitude("1", 0.0, (-1.0, 1.0))}), "k: its plausible size is not positive"),
        (
            Law("k*x**n", {"k": signed("x**n", 1.0)}, {"n": Shape("1", (2.0, 2.0), (1.0, 3.0))}),
            "n: a starting value comes twice",
        ),
    ],
)
def test_a_law_that_breaks_a_rule_is_refused(law: Law, said: str) -> None:
    with pytest.raises(BadInput, match=f"law broken: at rail: {re.escape(said)}"):
        check_effect(Broken(law), system("stage"), Place("port", "rail"), scales("stage"))


@every(lambda: (case for case in cases("stage", "pendulum") if case.linear))
def test_what_is_added_is_regressors_times_amplitudes(case: Case) -> None:
    added = case.added
    rng = np.random.default_rng(1)
    drawn = {name: rng.uniform(0.2, 1.0) * added.scales[name] for name in added.amplitudes}
    p = values(added, **drawn)
    place = at_place(added)
    without = place.xreplace({sp.Symbol(name, real=True): sp.S.Zero for name in drawn})
    with_it, before, *regressors = evaluated(added.system, [place, without, *added.regressors], p).T
    expected = before + sum(drawn[name] * r for name, r in zip(drawn, regressors, strict=True))
    assert_allclose(with_it, expected, rtol=1e-12, atol=1e-12 * np.abs(with_it).max())
    assert np.ptp(np.abs(regressors), axis=1).max() > 0.0 or len(set(added.regressors)) == 1


@every(lambda: (case for case in cases() if not case.added.linear))
def test_an_effort_that_depends_on_acceleration_holds_with_the_acceleration_that_it_makes(case: Case) -> None:
    """E = F + sum of amplitudes times what they add, at the acceleration of the system with the effect."""
    added, known = case.added, case.system
    port = known.port(case.place.name)
    amplitude = added.amplitudes[0]
    size = added.scales[amplitude]
    grown = added.system
    laws = {sp.Symbol(port.effort, real=True): port.law or sp.S.Zero}
    total = grown.signals[f"{port.effort}_total"].xreplace(laws)
    v = known.expression(port.velocity)
    rates = [sp.diff(v, x) * f for x, f in zip(grown.x, grown.closed, strict=True)]
    acceleration = sum(rates, sp.S.Zero)
    saturated = (v / sp.Symbol("i_s", real=True)) ** 2
    share = -saturated / (1 + saturated) if case.effect.family == "inductance_saturation" else 1
    adds = grown.closed[-1] - acceleration if added.memory else share * acceleration
    expected = (port.law or sp.S.Zero) + sp.Symbol(amplitude, real=True) * adds
    found, wanted = evaluated(grown, [total, expected], values(added, **{amplitude: size})).T
    assert_allclose(found, wanted, rtol=1e-9)


@every(lambda: (case for case in cases() if not case.added.linear))
def test_the_regressor_of_such_an_effort_is_its_tangent_at_zero(case: Case) -> None:
    added, port = case.added, case.system.port(case.place.name)
    laws = {sp.Symbol(port.effort, real=True): port.law or sp.S.Zero}
    total = added.system.signals[f"{port.effort}_total"].xreplace(laws)
    regressors = evaluated(added.system, list(added.regressors), values(added)).T
    for amplitude, regressor in zip(added.amplitudes, regressors, strict=True):
        h = 1e-6 * added.scales[amplitude]
        sides = (values(added, **{amplitude: side}) for side in (h, -h))
        above, below = (evaluated(added.system, [total], p)[:, 0] for p in sides)
        atol = 1e-6 * np.abs(regressor).max()
        assert_allclose((above - below) / (2.0 * h), regressor, rtol=1e-5, atol=atol)


def test_names_that_the_system_has_are_left_alone() -> None:
    (case,) = (c for c in cases("stage") if (c.effect.family, c.effect.variant) == ("coulomb_friction", ""))
    assert case.added.amplitudes == ("F_c_rail",)
    assert case.added.law == "F_c_rail*sign(v)"
    assert case.added.system.text["ports.rail.law"] == "F_c*tanh(v/v_c) + F_c_rail*tanh(v/v_c_rail)"
    (case,) = (c for c in cases("stage") if c.effect.variant == "dahl")
    assert case.added.memory == ("z_rail",)


@pytest.mark.parametrize("name", ["stage", "pendulum", "slider_crank"])
def test_an_effect_only_acts_where_the_port_has_what_it_needs(name: str) -> None:
    ports = tuple(replace(port, position=None, velocity=None) for port in system(name).ports)
    bare = replace(system(name), ports=ports)
    acting = [e for e in effects() for place in e.places(bare) if place.kind == "port"]
    demanding = [e for e in acting if isinstance(e, PortEffect) and e.needs]
    assert not demanding, "`suits` must also check what the base class checks: call super().suits"
    assert {"constant_load", "drift"} <= {e.family for e in acting}


def test_the_weight_of_something_that_turns_acts_on_torques_only() -> None:
    assert {case.name for case in cases() if case.effect.family == "gravity_load"} == {"pendulum", "coupling"}


def test_a_system_without_units_gets_numbers_without_units(tmp_path: Path) -> None:
    text = (
        "schema: system/1\nname: plain\nstates: {x: {unit: 1}, v: {unit: 1}}\ninputs: {u: {unit: 1}}\n"
        "outputs: {x: {unit: 1}}\nparameters: {b: {value: 2.0, unit: 1, identify: true}}\n"
        "ports: {rail: {effort: F, unit: 1, position: x, velocity: v}}\ndynamics: {x: v, v: u - b*v - F}\n"
    )
    plain = system_of(text, tmp_path)
    sizes = measured(plain)
    for each in effects():
        for place in each.places(plain):
            added = each.add(plain, place, sizes)
            assert set(added.units.values()) <= {"1", "s"}, each.family
            assert written_again(added.system, tmp_path).parameters == added.system.parameters


@every(
    lambda: (c for c in cases("stage", "pendulum") if c.effect.family == "torque_ripple" and c.added.shapes)
)
def test_a_ripple_is_at_least_one_wave(case: Case) -> None:
    """Over the travel, or per turn: less of one, with its overtones, fits whatever a spring does."""
    lowest = {"stage": 2.0 * np.pi / 0.6, "pendulum": 1.0}[case.name]
    (wave,) = case.added.shapes
    assert_allclose((case.added.bounds[wave][0], min(case.added.shapes[wave])), lowest, rtol=1e-3)


def test_no_effect_hides_the_states_that_the_outputs_show(tmp_path: Path) -> None:
    """Windows start at these states, with an effect as without it."""
    scaled = ("tip: {unit: m, expression: 2*x + 0.1}", "tip: {unit: V, expression: k_s*x + z_s}")
    numbers = "parameters:\n  k_s: {value: 3.0, unit: V/m}\n  z_s: {value: 0.2, unit: V}"
    alone = ("x: {unit: m}\n  tip", "tip")
    text = Path(__file__).with_name("stage.yaml").read_text()
    known = system_of(changed(text, scaled, alone, ("parameters:", numbers)), tmp_path)
    scales, shown = measured(known), [(reading.state, reading.output) for reading in readings(known)]
    assert shown == [(0, 0), (1, 0)]
    for each in effects():
        for place in each.places(known):
            grown = each.add(known, place, scales).system
            assert [(r.state, r.output) for r in readings(grown)] == shown, (each, place)


RAIL, DRIVE = Place("port", "rail"), Place("actuator", "u")


def together(known: System, chosen: list[tuple[str, str, Place]]) -> tuple[System, list[Added]]:
    """All of the effects, one after the other."""
    found: list[Added] = []
    for family, variant, place in chosen:
        found.append(effect(family, variant).add(known, place, scales("stage")))
        known = found[-1].system
    return known, found


def test_many_effects_share_a_system_without_sharing_names(tmp_path: Path) -> None:
    chosen = [
        *[("torque_ripple", "", RAIL)] * 2,
        *[("hysteresis", "dahl", RAIL), ("backlash", "mass", RAIL), ("coulomb_friction", "", RAIL)],
        *[("actuator_lag", "", DRIVE), ("actuator_saturation", "", DRIVE), ("actuator_gain", "", DRIVE)],
        *[("sensor_gain", "", Place("sensor", name)) for name in ("x", "tip")],
        *[("drift", "parameter", Place("parameter", "b")), ("scatter", "", Place("parameter", "F_c_rail"))],
    ]
    grown, found = together(system("stage"), chosen)
    names = [name for added in found for name in (*added.amplitudes, *added.shapes, *added.memory)]
    assert len(set(names)) == len(names)
    zero = {sp.Symbol(name, real=True): sp.S.Zero for added in found for name in added.amplitudes}
    assert tuple(f.xreplace(zero) for f in grown.closed[:2]) == system("stage").closed
    read = written_again(grown, tmp_path)
    p = np.array(grown.with_values(dict.fromkeys(names, 0.1)).values)
    both = [evaluated(s, list(s.closed), p) for s in (read, grown)]
    assert_allclose(*both, rtol=1e-9)


def test_an_inertia_error_holds_whatever_is_added_before_or_after() -> None:
    chosen = [("inertia_error", "", RAIL), ("coulomb_friction", "", RAIL), ("actuator_offset", "", DRIVE)]
    numbers = {"dM": 1.3, "F_c_rail": 2.0, "u_0": 0.4}
    rates = []
    for order in permutations(chosen):
        grown = together(system("stage"), list(order))[0].with_values(numbers)
        rates.append(values_of(grown, grown.closed, [0.1, -0.3], [0.5], [0.7]))
    assert_allclose(rates, np.tile(rates[0], (6, 1)), rtol=1e-12)


def test_states_of_effects_go_on_after_an_event(tmp_path: Path) -> None:
    clutch = built_in("clutch")
    sizes = measured(clutch)
    grown = effect("hysteresis", "lugre").add(clutch, Place("port", "load"), sizes).system
    grown = effect("actuator_lag").add(grown, Place("actuator", "u"), sizes).system
    (event,) = grown.events
    assert event.then is not None
    assert event.then[-2:] == grown.dynamics[-2:]
    read = written_again(grown, tmp_path)
    assert (read.states, read.ports, len(read.events[0].then or ())) == (grown.states, grown.ports, 7)


@pytest.fixture
def logs(tmp_path: Path) -> Logs:
    """Four experiments of the stage: two payloads, two groups."""
    known = system("stage")
    given = run(known, 80)
    x = given.x[:, 0]
    log = {"t": given.t, "drive": given.u[:, 0], "x": x, "tip": 2.0 * x + 0.1}
    return logs_of(known, tmp_path, [log] * 4, group=list("rrss"), m=[0.5, 1.2, 0.5, 1.2])


def test_an_effect_at_one_level_acts_in_no_other_experiment(logs: Logs) -> None:
    place = replace(RAIL, factor="m", level=np.float64(1.2))
    added = effect("coulomb_friction").add(system("stage"), place, scales("stage"))
    assert added.columns == {}
    assert added.system.text["ports.rail.law"].endswith("(m == 1.2)*F_c_rail*tanh(v/v_c_rail)")
    assert added.law == "F_c_rail*sign(v)"
    acting = values_of(added.system, added.regressors, np.ones(2), [0.0], logs.c)[:, 0]
    assert_allclose(acting, [0.0, 1.0, 0.0, 1.0], atol=1e-6)


def test_an_effect_in_one_group_brings_a_column(logs: Logs, tmp_path: Path) -> None:
    place = replace(RAIL, factor="group", level="s")
    added = effect("hysteresis", "dahl").add(system("stage"), place, scales("stage"))
    assert list(added.columns) == ["in_group"]
    grown = prepare(added.system, extended(logs, added.columns))
    assert grown.constants == ("m", "in_group")
    assert_allclose(grown.c[:, 1], [0.0, 0.0, 1.0, 1.0])
    assert list(grown.experiments["in_group"]) == [0.0, 0.0, 1.0, 1.0]
    assert grown.states == ("x", "v", "z_rail")
    assert np.abs(grown.x[:, 2]).max() > 0.01  # the memory was integrated along the measured motion
    assert written_again(added.system, tmp_path).operating_point == added.system.operating_point


def test_the_order_of_experiments_is_a_column(logs: Logs) -> None:
    place = Place("parameter", "b")
    added = effect("drift", "parameter_by_order").add(system("stage"), place, scales("stage"))
    assert_allclose(extended(logs, added.columns).c[:, 1], [0.0, 1.0, 2.0, 3.0])


def test_scatter_becomes_a_column_with_one_value_per_experiment(logs: Logs, tmp_path: Path) -> None:
    added = effect("scatter").add(system("stage"), Place("parameter", "b"), scales("stage"))
    (name,) = added.per_experiment
    assert name == "b_deviation"
    spread = in_columns(added.system, [Constant(name, "1")])
    values = np.array([0.1, -0.2, 0.3, 0.0])
    grown = prepare(spread, extended(logs, {name: values}))
    read, x, u = written_again(spread, tmp_path), [0.0, 0.4], [0.3]
    alone = [system("stage").with_values({"b": 31.0 * (1.0 + v)}) for v in values]
    each = [values_of(s, s.closed, x, u, c) for s, c in zip(alone, logs.c, strict=True)]
    assert_allclose(values_of(read, read.closed, x, u, grown.c), each, rtol=1e-12)


@pytest.mark.parametrize(
    ("family", "kind", "name"), [("input_delay", "actuator", "u"), ("sensor_delay", "sensor", "tip")]
)
def test_a_delay_adds_to_the_known_one(family: str, kind: str, name: str) -> None:
    late = system("stage")
    late = replace(late, inputs=tuple(replace(i, delay=0.01) for i in late.inputs))
    late = replace(late, outputs=tuple(replace(o, delay=0.01) for o in late.outputs))
    added = effect(family).add(late, Place(kind, name), scales("stage"))  # type: ignore[arg-type]
    ((shape, grid),) = added.shapes.items()
    assert grid[0] == 0.5 * PERIOD
    assert with_numbers(added.system, [added], {}) == late
    grown = with_numbers(added.system, [added], {shape: 0.004, "b": 30.0})
    items = {"actuator": grown.inputs, "sensor": grown.outputs}[kind]
    assert_allclose([i.delay for i in items if i.name == name], [0.014])
    assert dict(zip([p.name for p in grown.parameters], grown.values, strict=True))["b"] == 30.0
    with pytest.raises(ValueError, match="some of the experiments"):
        effect(family).add(late, Place(kind, name, "m", 1.2), scales("stage"))  # type: ignore[arg-type]


@pytest.mark.parametrize("place", [Place("port", "no"), Place("actuator", "no"), Place("sensor", "no")])
def test_a_place_that_is_not_there_is_refused(place: Place) -> None:
    for found in effects():
        if any(p.kind == place.kind for p in found.places(system("stage"))):
            with pytest.raises(KeyError):
                found.add(system("stage"), place, scales("stage"))


def test_a_gain_of_a_sensor_is_taken_out_of_the_states_that_it_shows(logs: Logs) -> None:
    added = effect("sensor_gain").add(system("stage"), Place("sensor", "x"), scales("stage"))
    (name,) = added.amplitudes
    seen = prepare(added.system.with_values({name: 0.25}), logs)
    assert_allclose(1.25 * seen.x[:, 0], logs.x[:, 0], rtol=1e-12)


@pytest.mark.parametrize("each", effects(), ids=lambda e: "-".join(filter(None, (e.family, e.variant))))
def test_the_arm_with_an_effect_is_written_and_read_back(each: Effect, tmp_path: Path) -> None:
    for place in islice(each.places(arm()), 2):
        grown = each.add(arm(), place, arm_scales()).system
        again = written_again(grown, tmp_path)
        assert [*map(str, again.dynamics)] == [*map(str, grown.dynamics)]


def test_an_inertia_at_a_joint_adds_to_the_mass_that_the_joint_feels() -> None:
    assert all(is_inertial(arm(), port) for port in arm().ports)
    added = effect("inertia_error").add(arm(), Place("port", "elbow"), arm_scales())
    (dM,) = added.amplitudes
    grown = added.system.with_values({dM: 0.02})
    larger = arm().with_values({"elbow_armature": 0.01 + 0.02})
    x, u = np.array([0.3, -0.4, 0.8, 1.0, -2.0, 0.5]), np.array([0.4, 1.0, 0.3])
    assert rates(grown, x[:3], x[3:], u) == pytest.approx(rates(larger, x[:3], x[3:], u), rel=1e-10)


@pytest.mark.parametrize("mass", [0.05, 0.5, 1.0, 2.0, 4.0, 0.0071])
@pytest.mark.parametrize("variant", ["", "with_weight"])
def test_a_round_mobility_keeps_its_unit_in_the_file(mass: float, variant: str, tmp_path: Path) -> None:
    given = robot_of(tmp_path, CART.format(mass))
    added = effect("inertia_error", variant).add(given, Place("port", "rail"), measured(given))
    system = with_numbers(added.system, [added], {"dM": 0.1 * mass})
    assert written_again(system, tmp_path) == system
