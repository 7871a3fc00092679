"""Effects on top of each other, in some experiments only, as delays, and one value per experiment."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from tests.physics.effects.benches import PERIOD, SYSTEMS, evaluated, measured, run, scales, system
from unmodelled.effects.added import Added, with_numbers
from unmodelled.effects.columns import extended, in_columns
from unmodelled.effects.effect import Effect
from unmodelled.effects.library import effects
from unmodelled.effects.place import Place
from unmodelled.logs.folder import read_logs
from unmodelled.logs.logs import Logs
from unmodelled.logs.preparation import prepare
from unmodelled.systems.model import Constant, System
from unmodelled.systems.numeric import numpy_system_function
from unmodelled.systems.reader import read_system
from unmodelled.systems.writer import write_system

RAIL, DRIVE = Place("port", "rail"), Place("actuator", "u")


def effect(family: str, variant: str = "") -> Effect:
    (found,) = (e for e in effects() if (e.family, e.variant) == (family, variant))
    return found


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
    write_system(grown, tmp_path / "all.yaml")
    read = read_system(tmp_path / "all.yaml")
    p = np.array(grown.with_values(dict.fromkeys(names, 0.1)).values)
    both = [evaluated(s, list(s.closed), p) for s in (read, grown)]
    assert_allclose(*both, rtol=1e-9)


def test_an_inertia_error_holds_whatever_is_added_before_or_after() -> None:
    chosen = [("inertia_error", "", RAIL), ("coulomb_friction", "", RAIL), ("actuator_offset", "", DRIVE)]
    numbers = {"dM": 1.3, "F_c_rail": 2.0, "u_0": 0.4}
    rates = []
    for order in permutations(chosen):
        grown = together(system("stage"), list(order))[0].with_values(numbers)
        function = numpy_system_function(grown, list(grown.closed), efforts_zero=True)
        x, u, c = np.array([0.1, -0.3]), np.array([0.5]), np.array([0.7])
        rates.append(function(0.0, x, u, np.empty(0), np.array(grown.values), c))
    assert_allclose(rates, np.tile(rates[0], (6, 1)), rtol=1e-12)


def test_states_of_effects_go_on_after_an_event(tmp_path: Path) -> None:
    clutch = read_system(SYSTEMS / "clutch.yaml")
    sizes = measured(replace(clutch, parameters=clutch.parameters))
    grown = effect("hysteresis", "lugre").add(clutch, Place("port", "load"), sizes).system
    grown = effect("actuator_lag").add(grown, Place("actuator", "u"), sizes).system
    (event,) = grown.events
    assert event.then is not None
    assert event.then[-2:] == grown.dynamics[-2:]
    write_system(grown, tmp_path / "clutch.yaml")
    read = read_system(tmp_path / "clutch.yaml")
    assert (read.states, read.ports, len(read.events[0].then or ())) == (grown.states, grown.ports, 7)


@pytest.fixture
def logs(tmp_path: Path) -> Logs:
    """Four experiments of the stage: two payloads, two groups."""
    known = system("stage")
    ids = ["a", "b", "c", "d"]
    table = {"id": ids, "file": [f"{i}.csv" for i in ids], "group": list("rrss"), "m": [0.5, 1.2, 0.5, 1.2]}
    pd.DataFrame(table).to_csv(tmp_path / "experiments.csv", index=False)
    given = run(known, 80)
    for i in ids:
        x = given.x[:, 0]
        log = {"t": given.t, "drive": given.u[:, 0], "x": x, "tip": 2.0 * x + 0.1}
        pd.DataFrame(log).to_csv(tmp_path / f"{i}.csv", index=False)
    return read_logs(tmp_path, known)


def test_an_effect_at_one_level_acts_in_no_other_experiment(logs: Logs) -> None:
    place = replace(RAIL, factor="m", level=np.float64(1.2))
    added = effect("coulomb_friction").add(system("stage"), place, scales("stage"))
    assert added.columns == {}
    assert added.system.text["ports.rail.law"].endswith("(m == 1.2)*F_c_rail*tanh(v/v_c_rail)")
    assert added.law == "F_c_rail*sign(v)"
    regressor = numpy_system_function(added.system, list(added.regressors), efforts_zero=True)
    p = np.array(added.system.values)
    acting = regressor(0.0, np.ones(2), np.zeros(1), np.empty(0), p, logs.c)[:, 0]
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
    write_system(added.system, tmp_path / "group.yaml")
    assert read_system(tmp_path / "group.yaml").operating_point == added.system.operating_point


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
    write_system(spread, tmp_path / "spread.yaml")
    read = read_system(tmp_path / "spread.yaml")
    rates = numpy_system_function(read, list(read.closed), efforts_zero=True)
    x, u = np.array([0.0, 0.4]), np.array([0.3])
    found = rates(0.0, x, u, np.empty(0), np.array(read.values), grown.c)
    each = [
        numpy_system_function(s, list(s.closed), efforts_zero=True)(
            0.0, x, u, np.empty(0), np.array(s.values), logs.c[i]
        )
        for i, s in enumerate(system("stage").with_values({"b": 31.0 * (1.0 + v)}) for v in values)
    ]
    assert_allclose(found, each, rtol=1e-12)


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


def test_channels_have_the_names_of_the_contract() -> None:
    assert RAIL.channel == "rail"
    assert DRIVE.channel == "actuator:u"
    assert Place("sensor", "x").channel == "sensor:x"


def test_a_gain_of_a_sensor_is_taken_out_of_the_states_that_it_shows(logs: Logs) -> None:
    added = effect("sensor_gain").add(system("stage"), Place("sensor", "x"), scales("stage"))
    (name,) = added.amplitudes
    seen = prepare(added.system.with_values({name: 0.25}), logs)
    assert_allclose(1.25 * seen.x[:, 0], logs.x[:, 0], rtol=1e-12)
