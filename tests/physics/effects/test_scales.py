"""Sizes along measurements, and laws of temperatures: none has 0 K as its reference."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.machines.folders import system_of
from tests.machines.known import Array, runge_kutta
from tests.physics.effects.benches import PERIOD, measured, run, system
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales, Spread
from unmodelled.effects.surroundings import surroundings
from unmodelled.systems.model import System
from unmodelled.systems.numeric import numpy_system_function


def test_the_lacking_effort_of_a_port_is_recovered_from_slopes() -> None:
    """The pendulum moves as it would with a torque of 0.4 sin(30 t) besides."""
    known, n = system("pendulum"), 3000
    closed, p, t = numpy_system_function(known, list(known.closed)), np.array(known.values), np.arange(n)

    def rates(now: float, x: Array) -> Array:
        return closed(now, x, np.zeros(1), np.array([0.4 * np.sin(30.0 * now)]), p, np.empty(0))

    x = runge_kutta(rates, np.array([0.2, 0.0]), PERIOD * t)
    none = np.zeros((n, 1)), np.empty((1, 0))
    found = Scales.measured(known, PERIOD, np.array([0, n]), PERIOD * t, x, *none)
    assert found.effort["joint"] == pytest.approx(0.4 / np.sqrt(2.0), rel=0.05)
    assert found.mobility["joint"] == pytest.approx(1.0 / 0.02)
    assert found.duration == pytest.approx(2.999)


def test_every_quantity_has_a_spread() -> None:
    known, given = system("slider_crank"), run(system("slider_crank"))
    found = measured(known)
    numbers = [item.name for item in (*known.parameters, *known.operating_point)]
    assert set(found.of) == {"theta", "omega", "T", *known.signals, *numbers}
    assert set(found.outputs) == {"theta", "omega"}
    assert_allclose(found.of["theta"].low, given.x[:, 0].min())
    assert_allclose(found.of["d"].high, 0.1, rtol=1e-3)


def test_a_quantity_that_never_changes_or_has_no_value_has_a_small_spread() -> None:
    assert Spread.of(np.zeros(5)).rms > 0.0
    assert Spread.of(np.zeros(5)).half > 0.0
    assert Spread.of(np.array([np.nan, np.inf])) == Spread(0.0, 0.0, 1e-12)
    assert Spread.of(np.array([np.nan, 3.0, 4.0])) == Spread(3.0, 4.0, np.sqrt(12.5))


OVEN = """
schema: system/1
name: oven
states: {T: {unit: K}}
inputs: {P: {unit: W}INPUTS}
outputs: {T: {unit: K}}
operating_point: {CONSTANTS}
parameters: {C: {value: 800, unit: J/K}PARAMETERS}
ports: {wall: {effort: q, unit: W, position: T}}
dynamics: {T: (P - q)/C}
"""
AMBIENT = "T_amb: {value: 294, unit: K}"


def oven(folder: Path, inputs: str = "", constants: str = "", parameters: str = "") -> System:
    text = OVEN.replace("INPUTS", inputs).replace("CONSTANTS", constants).replace("PARAMETERS", parameters)
    return system_of(text.replace("operating_point: {}\n", ""), folder)


def scales(system: System, low: float, high: float) -> Scales:
    n, t = 400, np.arange(400.0)
    x = (0.5 * (low + high) + 0.5 * (high - low) * np.sin(0.05 * t))[:, None]
    u = np.column_stack([40.0 + 0.0 * t, *[290.0 + 3.0 * np.cos(0.02 * t)] * (len(system.inputs) - 1)])
    c = np.full((1, len(system.operating_point)), 292.0)
    return Scales.measured(system, 1.0, np.array([0, n]), t, x, u, c)


def laws(system: System, sizes: Scales, families: set[str]) -> dict[tuple[str, str], str]:
    """Texts of the laws at all places, by family and variant."""
    found = [(e, p) for e in effects() if e.family in families for p in e.places(system)]
    return {(e.family, e.variant): e.add(system, p, sizes).law for e, p in found}


@pytest.mark.parametrize(
    ("where", "text", "reference"),
    [
        ("inputs", ", T_amb: {unit: K}", "T_amb"),
        ("constants", "T_amb: {unit: K}", "T_amb"),
        ("parameters", f", {AMBIENT}", "T_amb"),
        ("parameters", f", {AMBIENT}, T_set: {{value: 350, unit: K}}", None),
        ("parameters", "", None),
    ],
)
def test_heat_is_lost_to_a_known_temperature_or_to_one_that_is_fitted(
    tmp_path: Path, where: str, text: str, reference: str | None
) -> None:
    system = oven(tmp_path, **{where: text})
    found = surroundings(system, system.ports[0])
    assert (found and found.name) == reference
    losses = laws(system, scales(system, 300.0, 360.0), {"linear_loss", "radiation"})
    known = {("linear_loss", "to_known"): "k*(T - T_amb)", ("radiation", "to_known"): "k*(T**4 - T_amb**4)"}
    free = {("linear_loss", "to_surroundings"): "k*(T - x_a)", ("radiation", ""): "k*(T**4 - x_a**4)"}
    assert losses == free | (known if reference else {})


def test_a_fitted_temperature_of_the_surroundings_is_no_known_one(tmp_path: Path) -> None:
    """Added by a law at one port, it is no reference of another law."""
    system = oven(tmp_path)
    sizes, (loss,) = scales(system, 300.0, 360.0), [e for e in effects() if e.variant == "to_surroundings"]
    grown = loss.add(system, Place("port", "wall"), sizes).system
    assert surroundings(grown, grown.ports[0], sizes.of) is None


@pytest.mark.parametrize(("low", "absolute"), [(300.0, True), (0.0, False)])
def test_a_gain_of_a_temperature_is_about_zero_degrees(tmp_path: Path, low: float, absolute: bool) -> None:
    """Of a rise above another temperature it is about no rise."""
    system = oven(tmp_path, inputs=", T_oil: {unit: K}")
    families = {"sensor_gain", "actuator_gain", "input_dependence"}
    found = laws(system, scales(system, low, low + 60.0), families)
    assert found["sensor_gain", ""] == ("T + g*(T - y_z)" if absolute else "(1 + g)*T")
    assert found["actuator_gain", ""] == "T_oil + g*(T_oil - u_z)"
    assert found["input_dependence", "load"] == "wall_per_T_oil*(T_oil - w_0)"
