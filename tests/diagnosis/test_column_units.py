"""Tables of figures and of the page are in the units of the logs; their numbers stay the same quantities."""

from math import pi
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis import test_told as told
from tests.machines.folders import system_of
from unmodelled.api.learned_laws import _errors as learned_errors
from unmodelled.api.simulation import _errors as simulated_errors
from unmodelled.diagnosis.answer.column_units import (
    axis_unit,
    channels_in_columns,
    regions_in_columns,
    table_in_columns,
)
from unmodelled.diagnosis.answer.live import _scale
from unmodelled.diagnosis.answer.live_machine import about_machine, machine
from unmodelled.diagnosis.answer.live_numbers import _as_said
from unmodelled.diagnosis.data.gap import Off
from unmodelled.effects.place import Place
from unmodelled.logs.logs import Logs
from unmodelled.report.headline import as_said

CHANNELS = {
    "gear": {
        **{"kind": "port", "name": "gear", "unit": "N m", "symbol": "tau"},
        **{"level": {"name": "theta", "unit": "rad"}, "rate": {"name": "omega", "unit": "rad/s"}},
        "acceleration": {"name": "d(omega)/dt", "unit": "rad/s^2"},
    },
    "actuator:i": {
        **{"kind": "actuator", "name": "i", "unit": "A"},
        **{"level": {"name": "i", "unit": "A"}, "rate": {"name": "d(i)/dt", "unit": "(A)/s"}},
    },
}


@pytest.mark.parametrize(
    ("text", "name", "unit", "one", "zero"),
    [
        (told.TABLE, "theta", "deg", pi / 180, 0.0),
        (told.TABLE, "d(omega)/dt", "rpm/s", pi / 30, 0.0),
        (told.TABLE, "d(i)/dt", "mA/s", 1e-3, 0.0),
        (told.BOILER, "T", "degC", 274.15, 273.15),
        (told.BOILER, "d(T)/dt", "K/s", 1.0, 0.0),
        (told.BOILER_F, "d(T)/dt", "degF/s", 5 / 9, 0.0),
        (told.SLIDE, "v", None, 0.0, 0.0),
    ],
)
def test_a_coordinate_has_the_unit_of_the_column_that_shows_it(
    tmp_path: Path, text: str, name: str, unit: str | None, one: float, zero: float
) -> None:
    shown = axis_unit(system_of(text, tmp_path), name)
    assert (shown and shown.text) == unit
    if shown is not None:
        np.testing.assert_allclose(shown.to_si(np.array([0.0, 1.0])), [zero, one], atol=1e-12)


def test_corrections_and_laws_are_in_these_units(tmp_path: Path) -> None:
    system = system_of(told.TABLE, tmp_path)
    about = channels_in_columns(system, CHANNELS)
    assert [about["gear"][k]["unit"] for k in ("level", "rate", "acceleration")] == ["deg", "rpm", "rpm/s"]
    assert (about["gear"]["unit"], about["actuator:i"]["unit"]) == ("N m", "mA")
    row = {"level": 0.5, "rate": 2.0, "acceleration": np.nan, "value": 0.3, "error": 0.1}
    row |= {"law": 0.2, "t": 7.0}
    table = pd.DataFrame([{"channel": name, **row} for name in CHANNELS])
    gear, drive = table_in_columns(system, CHANNELS, table).to_dict("records")
    assert gear["level"] == pytest.approx(90 / pi) and gear["rate"] == pytest.approx(60 / pi)
    assert (gear["value"], gear["error"], gear["t"]) == (0.3, 0.1, 7.0)  # an effort stays in SI
    expected = {"level": 500.0, "rate": 2000.0, "value": 300.0, "error": 100.0, "law": 200.0}
    assert {key: drive[key] for key in expected} == pytest.approx(expected)
    laws = pd.DataFrame({"channel": ["gear"], "x": [pi], "low": [0.1], "law": [0.2], "high": [0.3]})
    levels = {"gear": "level", "actuator:i": "level"}
    (law,) = table_in_columns(system, CHANNELS, laws, levels).to_dict("records")
    assert law["x"] == pytest.approx(180.0) and law["law"] == 0.2
    assert table["level"].tolist() == [0.5, 0.5]  # the given table is not changed


def test_regions_are_in_these_units(tmp_path: Path) -> None:
    row = {"signal": "T", "low": 300.15, "high": 310.15, "share": 0.4}
    (region,) = regions_in_columns(system_of(told.BOILER, tmp_path), [row])
    assert (region["low"], region["high"], region["share"]) == pytest.approx((27.0, 37.0, 0.4))
    other = {"signal": "nothing", "low": 1.0, "high": 2.0, "share": 0.4}
    assert regions_in_columns(system_of(told.BOILER, tmp_path), [other]) == [other]


def test_the_page_shows_outputs_in_the_units_of_their_columns(tmp_path: Path) -> None:
    system = system_of(told.BOILER, tmp_path)
    t = 0.5 * np.arange(120)
    frame = pd.DataFrame({"t": t, "valve": 50.0 + 10.0 * np.sin(t), "T": 20.0 + np.sin(0.1 * t)})
    logs = Logs.from_frames({"a": frame, "b": frame}, system)
    data = machine(system, logs, [output.expression for output in system.outputs], 5.0)
    (output,) = data["outputs"]
    assert output == {"name": "T", "unit": "degC", "error_unit": "K", "factor": 1.0, "offset": 273.15}
    assert data["inputs"] == [{"name": "valve", "unit": "%"}]
    drawn = about_machine(system)
    assert (drawn["inputs"][0]["unit"], drawn["outputs"][0]["unit"]) == ("%", "degC")
    assert _scale("x", system.outputs[0].as_written) == {"x_unit": "degC", "x_scale": [1.0, 273.15]}
    assert _scale("y", system.outputs[0].as_difference) == {}
    plain = system_of(told.SLIDE, tmp_path)
    assert about_machine(plain)["outputs"] == [{"name": "x", "unit": "m"}]


@pytest.mark.parametrize(
    ("text", "where", "number", "said"),
    [
        (told.BOILER, (*told.LOSS, told.WALL), ("x_a", 297.15), "x_a = 24 degC"),
        (told.TABLE, (*told.PLAY, told.PORT), ("delta", pi / 180), "2·delta = 2 deg"),
        (told.SLIDE, (*told.PART, told.BELT), ("omega_f", 14 * pi), "omega_f/(2·pi) = 7 Hz"),
    ],
)
def test_a_slider_says_its_number_as_the_sentences_do(
    tmp_path: Path, text: str, where: tuple[str, str, Place], number: tuple[str, float], said: str
) -> None:
    name, value = number
    one = _as_said(told.found(system_of(text, tmp_path), *where, {name: value}).added, name)["said"]
    assert f"{one['symbol']} = {one['slope'] * value + one['shift']:.10g} {one['unit']}" == said


def test_pages_of_a_training_and_of_a_simulation_say_errors_in_the_units_of_the_columns(
    tmp_path: Path,
) -> None:
    item = system_of(told.TABLE, tmp_path).outputs[0]
    off = Off("rad", pi / 180, None, item.as_difference)
    for entry in (simulated_errors(off), learned_errors(off, off)):
        assert (entry["unit"], entry["known"]) == ("rad", pi / 180)
        assert as_said(entry)["unit"] == "deg" and as_said(entry)["known"] == pytest.approx(1.0)
    plain = Off("m", 0.1, 0.2, system_of(told.SLIDE, tmp_path).outputs[0].as_difference)
    assert as_said(simulated_errors(plain)) == {"unit": "m", "known": 0.1, "known_whole_run": 0.2}
    assert learned_errors(plain, plain)["formulas_whole_run"] == 0.2
