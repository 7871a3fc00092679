"""Every effect at every kind of place: level zero, linearity, regressors, names, units, files."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from tests.every import every
from tests.machines.folders import system_of
from tests.physics.effects.benches import Case, at_place, cases, evaluated, measured, scales, system, values
from unmodelled.base.errors import BadInput
from unmodelled.effects.contract import check_effect
from unmodelled.effects.effect import PortEffect
from unmodelled.effects.law import Amplitude, Law, Shape, signed
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place, Site
from unmodelled.logs.readings import readings
from unmodelled.systems.reader import read_system
from unmodelled.systems.writer import write_system


def test_no_two_effects_share_family_and_variant_and_the_simplest_come_first() -> None:
    names = [f"{effect.family} {effect.variant}".strip() for effect in effects()]
    assert len(set(names)) == len(names), "give the new effect another variant"
    complexities = [effect.complexity for effect in effects()]
    assert complexities == sorted(complexities)


def test_every_effect_is_tried_somewhere() -> None:
    untried = set(effects()) - {case.effect for case in cases()}
    assert not untried, f"{untried}: no system has a place for it: add one to FILES of benches.py"


def test_no_drive_lies_between_a_measured_input_and_the_physics() -> None:
    known = read_system(Path("systems/pendulum.yaml"))
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
    complexity: float = 1.0

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
        above, below = (
            evaluated(added.system, [total], values(added, **{amplitude: s * h}))[:, 0] for s in (1.0, -1.0)
        )
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
    for effect in effects():
        for place in effect.places(plain):
            added = effect.add(plain, place, sizes)
            assert set(added.units.values()) <= {"1", "s"}, effect.family
            write_system(added.system, tmp_path / "grown.yaml")
            assert read_system(tmp_path / "grown.yaml").parameters == added.system.parameters


@every(lambda: (case for case in cases("stage", "pendulum") if case.effect.family == "torque_ripple"))
def test_a_ripple_is_at_least_one_wave(case: Case) -> None:
    """Over the travel, or per turn: less of one, with its overtones, fits whatever a spring does."""
    lowest = {"stage": 2.0 * np.pi / 0.6, "pendulum": 1.0}[case.name]
    (wave,) = case.added.shapes
    assert_allclose((case.added.bounds[wave][0], min(case.added.shapes[wave])), lowest, rtol=1e-3)


def test_no_effect_hides_the_states_that_the_outputs_show(tmp_path: Path) -> None:
    """Windows start at these states, with an effect as without it."""
    file = tmp_path / "scaled.yaml"
    text = (Path(__file__).with_name("stage.yaml")).read_text()
    text = text.replace("tip: {unit: m, expression: 2*x + 0.1}", "tip: {unit: V, expression: k_s*x + z_s}")
    file.write_text(
        text.replace("x: {unit: m}\n  tip", "tip").replace(
            "parameters:", "parameters:\n  k_s: {value: 3.0, unit: V/m}\n  z_s: {value: 0.2, unit: V}"
        )
    )
    known = read_system(file)
    scales, shown = measured(known), [(reading.state, reading.output) for reading in readings(known)]
    assert shown == [(0, 0), (1, 0)]
    for effect in effects():
        for place in effect.places(known):
            grown = effect.add(known, place, scales).system
            assert [(r.state, r.output) for r in readings(grown)] == shown, (effect, place)
