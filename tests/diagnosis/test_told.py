"""Numbers, tables and the page of an answer are in the words of the trade and in the units of the logs."""

from collections.abc import Mapping
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.diagnosis.planted import added_somewhere
from tests.diagnosis.studies import effect
from tests.machines.folders import changed, system_of, text_of
from unmodelled.api.learned_laws import _errors as learned_errors
from unmodelled.api.simulation import _errors as simulated_errors
from unmodelled.base.sure_numbers import as_said, main_number
from unmodelled.base.wording import amounts, part_of
from unmodelled.diagnosis.answer.column_units import (
    axis_unit,
    channels_in_columns,
    regions_in_columns,
    table_in_columns,
)
from unmodelled.diagnosis.answer.live import _scale
from unmodelled.diagnosis.answer.live_machine import about_machine, machine
from unmodelled.diagnosis.answer.live_numbers import _as_said
from unmodelled.diagnosis.answer.sentences import _verdict as verdict_lines
from unmodelled.diagnosis.answer.sentences import numbers_of
from unmodelled.diagnosis.answer.summary import _effect
from unmodelled.diagnosis.data.gap import Off
from unmodelled.diagnosis.data.result import DiagnosedEffect, Estimate
from unmodelled.effects.library import kind_of
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales, Spread
from unmodelled.logs.logs import Logs
from unmodelled.report.answers import _main_amount
from unmodelled.report.diagnosis_tables import parameter_tables, units_table
from unmodelled.report.headline import outcome
from unmodelled.systems.model import System

#: A turntable on a gear: current in mA, angle in degrees, speed in rpm.
TABLE = text_of("turntable.yaml")
#: The same in SI units, as a slide.
SLIDE = text_of("slide.yaml")
#: A boiler in degrees Celsius whose valve is in percent.
BOILER = text_of("boiler.yaml")
#: The same boiler with a sensor of its surroundings, in degrees Fahrenheit.
BOILER_F = changed(BOILER, ("degC", "degF"), ('{unit: "%"}}', '{unit: "%"}, hall: {unit: degF}}'))


def found(
    system: System, family: str, variant: str, place: Place, numbers: Mapping[str, float]
) -> DiagnosedEffect:
    """An effect as a diagnosis finds it, with numbers in SI units that are known to a tenth."""
    spread = Spread(-1.0, 1.0, 0.5)
    names = [*(s.name for s in system.states), *(i.name for i in system.inputs)]
    names += [o.name for o in system.outputs]
    of = {name: Spread(290.0, 350.0, 320.0) if name in ("T", "hall") else spread for name in names}
    ports = {port.name: 3.0 for port in system.ports}
    mobility = {port.name: 0.2 if system.name == "slide" else 20.0 for port in system.ports}
    parameters = {p.name: Spread(p.value, p.value, p.value) for p in system.parameters}
    outputs = {output.name: spread for output in system.outputs}
    scales = Scales(of | parameters, outputs, ports, mobility, period=0.01, duration=20.0)
    added = effect(family, variant).add(system, place, scales)
    assert set(numbers) <= set(added.reported), added.reported
    estimates = {
        name: Estimate(added.units[name], float("nan"), value, (0.9 * value, 1.1 * value))
        for name, value in numbers.items()
    }
    return DiagnosedEffect(added, estimates, {}, 0.9, 0.95, (0.9, 1.0), ())


def content(one: DiagnosedEffect) -> dict[str, Any]:
    return _effect(one, {one.added.place: one.added.place.channel})


PORT, BELT, WALL = Place("port", "gear"), Place("port", "belt"), Place("port", "wall")
VALVE, CURRENT, ANGLE = Place("actuator", "valve"), Place("actuator", "i"), Place("sensor", "angle")
PLAY, PART = ("backlash", "friction"), ("flexible_transmission", "part")
LOSS = ("linear_loss", "to_surroundings")
CASES = [
    (TABLE, PLAY, PORT, {"F_b": 0.2, "delta": 0.5 * pi / 180}, "1 deg of play from stop to stop at gear"),
    (SLIDE, PLAY, BELT, {"F_b": 2.0, "delta": 0.0004}, "0.8 mm of play from stop to stop at belt"),
    (
        *(SLIDE, ("backlash", "mass"), BELT, {"m_b": 1.5, "delta": 0.0025}),
        "5 mm of play from stop to stop; 1.5 of 5.0 kg behind it, at belt",
    ),
    (
        *(SLIDE, ("nonlinear_spring", "play"), BELT, {"k": 120.0, "delta": 0.001, "x_0": 0.0}),
        "spring of 120 N/m with 2 mm of play from stop to stop at belt",
    ),
    (
        *(SLIDE, PART, BELT, {"m_b": 3.57, "omega_f": 2 * pi * 12.4, "zeta": 0.06}),
        "resonance at 12.4 Hz, damping ratio 0.06; 3.6 of 5.0 kg behind it, at belt",
    ),
    (
        *(TABLE, PART, PORT, {"m_b": 0.018, "omega_f": 2 * pi * 3.1, "zeta": 0.12}),
        "resonance at 3.1 Hz, damping ratio 0.12; 0.018 of 0.050 kg m² behind it, at gear",
    ),
    (
        *(SLIDE, (PART[0], "load"), BELT, {"m_b": 0.8, "omega_f": 2 * pi * 4.0, "zeta": 0.3}),
        "resonance at 4 Hz, damping ratio 0.3; 0.8 kg behind it that the model lacks, at belt",
    ),
    (BOILER, LOSS, WALL, {"k": 2.2, "x_a": 297.15}, "loss of 2.2 W/K to surroundings at 24 degC at wall"),
    (BOILER_F, LOSS, WALL, {"k": 2.2, "x_a": 297.15}, "loss of 2.2 W/K to surroundings at 75.2 degF at wall"),
    (BOILER_F, (LOSS[0], "to_known"), WALL, {"k": 2.2}, "loss of 2.2 W/K to hall at wall"),
    (BOILER, ("actuator_dead_zone", ""), VALVE, {"u_d": 0.035}, "dead zone of ±3.5 % at input valve"),
    (TABLE, ("actuator_saturation", ""), CURRENT, {"u_max": 0.8}, "saturation at ±800 mA at input i"),
    (
        *(TABLE, ("cyclic_error", ""), ANGLE, {"A_s": 0.03, "A_c": -0.04, "n_y": 3.0}),
        "cyclic error of 2.86 deg 3 times per turn, largest at 48 deg, at sensor angle",
    ),
    (
        *(TABLE.replace("angle: {unit: deg", "angle: {unit: rad"), ("cyclic_error", "with_overtone"), ANGLE),
        {"A_s": 0.0225, "A_c": 0.0268, "B_s": 0.008, "B_c": -1e-9},
        "cyclic error of 35 mrad once per turn, largest at 40 deg; 8 mrad twice per turn, largest at 45 deg, "
        "at sensor angle",
    ),
]


@pytest.mark.parametrize(("text", "effect", "place", "numbers", "words"), CASES)
def test_an_effect_is_told_in_the_words_of_the_trade(
    tmp_path: Path, text: str, effect: tuple[str, str], place: Place, numbers: dict[str, float], words: str
) -> None:
    told = content(found(system_of(text, tmp_path), *effect, place, numbers))
    kind = {"actuator": "input ", "sensor": "sensor "}.get(place.kind, "")
    where = f"at {kind}{place.name}"
    assert told["text"].replace("\xa0", " ") == words.removesuffix(where).rstrip(" ,")
    for name, value in numbers.items():  # what is stored stays in SI units
        assert told["parameters"][name]["value"] == value
    assert _main_amount(told) == told["text"]
    gap = {"units": {"y": {"unit": "m", "known": 2.0, "augmented": 1.0}}, "horizon": 0.3, "shrink": 1.0}
    line = outcome({"effects": [told], "gap": gap, "verdict": "effect", "confidence": 0.9})
    assert line.replace("\xa0", " ").lower().startswith(f"{words}: the error".lower())


def test_another_value_is_told_beside_that_of_the_file(tmp_path: Path) -> None:
    """Of a wrong number, the right one, never the error that is added."""
    wrong = Place("parameter", "k")
    one = found(system_of(TABLE, tmp_path), "parameter_error", "", wrong, {"k_error": 0.3})
    told = content(one)
    assert told["law"] == "k = 0.7"
    assert told["text"].replace("\xa0", " ") == "k = 0.7 N m/A instead of 0.4"
    told |= {"parameter": "k", "port": "gear"}
    assert list(numbers_of(told)) == ["k = 0.700 N m/A (95 % interval 0.670 to 0.730)"]
    answer = {"effects": [told], "logs": [], "verdict": "effect", "confidence": 0.9, "remainder": None}
    lines = [line.replace("\xa0", " ") for line in verdict_lines(answer)]
    assert lines[1].startswith("- Parameter error of k: k = 0.7 N m/A instead of 0.4 (explains 95 %")
    assert not any("k_error" in line for line in lines)
    gap = {"units": {"y": {"unit": "m", "known": 2.0, "augmented": 1.0}}, "horizon": 0.3, "shrink": 1.0}
    assert outcome({**answer, "gap": gap}).startswith("k = 0.7")
    (table,) = parameter_tables({"effects": [told]})
    assert table.rows[0][0].text == "k"


def test_a_usual_mistake_stands_beside_the_right_value(tmp_path: Path) -> None:
    wrong = Place("parameter", "k")
    one = found(system_of(TABLE, tmp_path), "parameter_error", "", wrong, {"k_error": 22.518})
    told = content(one)["text"].replace("\xa0", " ")
    assert told == "k = 22.9 N m/A instead of 0.4 (57.3 times too small, as by degrees instead of radians)"


@pytest.mark.parametrize(
    ("text", "law", "place", "kind"),
    [
        (BOILER, LOSS, WALL, "heat loss"),
        (BOILER, ("storage", ""), WALL, "storage"),
        (text_of("tank.yaml"), ("root_outflow", ""), Place("port", "vessel"), "outflow"),
        (TABLE, ("viscous_friction", ""), PORT, "damping"),
    ],
)
def test_what_a_balance_loses_has_its_name(
    tmp_path: Path, text: str, law: tuple[str, str], place: Place, kind: str
) -> None:
    assert kind_of(found(system_of(text, tmp_path), *law, place, {}).added) == kind


@pytest.mark.parametrize(
    ("text", "place", "value", "line"),
    [
        (TABLE, CURRENT, 0.012, "u_0 = 12.0 mA (95 % interval 10.8 to 13.2)"),
        (BOILER, VALVE, 0.02, "u_0 = 2.00 % (95 % interval 1.80 to 2.20)"),
        (TABLE, Place("sensor", "angle"), pi / 90, "y_0 = 2.00 deg (95 % interval 1.80 to 2.20)"),
        (BOILER, Place("sensor", "T"), 2.0, "y_0 = 2.00 K (95 % interval 1.80 to 2.20)"),
        (BOILER_F, Place("sensor", "T"), 5.0, "y_0 = 9.0 degF (95 % interval 8.1 to 9.9)"),
        (SLIDE, Place("actuator", "F"), 0.5, "u_0 = 0.50 N (95 % interval 0.45 to 0.55)"),
    ],
)
def test_an_offset_is_in_the_unit_of_its_column(
    tmp_path: Path, text: str, place: Place, value: float, line: str
) -> None:
    name, _, amount = line.partition(" (")[0].partition(" = ")
    told = content(found(system_of(text, tmp_path), f"{place.kind}_offset", "", place, {name: value}))
    assert list(numbers_of(told)) == [line]
    number = main_number(told)
    assert number is not None
    assert amounts([number["value"]], number["unit"]) == amounts(
        [float(amount.split()[0])], amount.split()[1]
    )
    (table,) = parameter_tables({"effects": [told]})
    assert table.rows[0][-1].text == number["unit"]


def test_lines_and_tables_say_what_a_number_is(tmp_path: Path) -> None:
    numbers = {"m_b": 3.57, "omega_f": 2 * pi * 12.4, "zeta": 0.06}
    one = found(system_of(SLIDE, tmp_path), *PART, BELT, numbers)
    assert list(numbers_of(content(one))) == [
        "m_b = 3.57 of 5 kg (95 % interval 3.21 to 3.93), behind it",
        "omega_f/(2*pi) = 12.4 Hz (95 % interval 11.2 to 13.6), resonance",
        "zeta = 0.060 (95 % interval 0.054 to 0.066), damping ratio",
    ]
    (table,) = parameter_tables({"effects": [content(one)]})
    assert [(row[0].text, row[0].note, row[-1].text) for row in table.rows] == [
        ("m_b", "behind it", "kg"),
        ("omega_f/(2·pi)", "resonance", "Hz"),
        ("zeta", "damping ratio", "–"),
    ]


def test_the_speed_of_a_stribeck_curve_is_in_the_unit_of_the_speed_sensor(tmp_path: Path) -> None:
    one = found(system_of(TABLE, tmp_path), "stribeck_friction", "", PORT, {"v_s": pi / 10})
    assert list(numbers_of(content(one))) == ["v_s = 3.00 rpm (95 % interval 2.70 to 3.30)"]


def test_a_number_that_the_logs_leave_open_is_in_no_phrase(tmp_path: Path) -> None:
    one = found(system_of(BOILER, tmp_path), *LOSS, WALL, {"k": 2.2, "x_a": 297.15})
    one.estimates["x_a"].__dict__["determined"] = False
    assert "text" not in content(one)


@pytest.mark.parametrize(
    ("text", "output", "unit", "factor"),
    [
        *((TABLE, 0, "deg", 180 / pi), (TABLE, 1, "rpm", 30 / pi)),
        *((BOILER, 0, "K", 1.0), (BOILER_F, 0, "degF", 1.8)),
    ],
)
def test_errors_are_in_the_units_of_the_columns(
    tmp_path: Path, text: str, output: int, unit: str, factor: float
) -> None:
    item = system_of(text, tmp_path).outputs[output]
    off = Off(item.unit, 0.5, None, item.as_difference)
    assert off.as_logged.unit == unit and off.as_logged.at_horizon == pytest.approx(0.5 * factor)
    assert off.says(0.1).startswith(f"{0.5 * factor:.2g} {unit} off")
    assert Off(item.unit, 160.0, None).says(0.1).startswith(f"160 {item.unit} off")
    assert (off.unit, off.at_horizon) == (item.unit, 0.5)
    entry: dict[str, Any] = {"unit": item.unit, "known": 0.5, "known_whole_run": None}
    entry |= {"augmented": 0.1, "augmented_whole_run": 0.2}
    said = {"unit": unit, **{k: v if v is None else factor * v for k, v in entry.items() if k != "unit"}}
    gap = {"units": {"y": {**entry, "shown": said}}, "horizon": 0.1}
    table = units_table({"gap": gap, "effects": [1], "verdict": "effect"})
    assert [row[-1].text.split("\xa0")[-1] for row in table.rows] == [unit, unit]
    assert [row[-1] for row in table.download] == ["Unit", unit, unit]
    assert float(table.rows[0][2].exact) == pytest.approx(0.5 * factor)


def test_a_part_of_a_whole_has_the_digits_of_the_smaller_one() -> None:
    assert part_of(0.0012, 0.5, "kg") == "0.0012 of 0.5000\xa0kg"
    assert part_of(120.0, 900.0, "kg") == "120 of 900\xa0kg"


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
        (TABLE, "theta", "deg", pi / 180, 0.0),
        (TABLE, "d(omega)/dt", "rpm/s", pi / 30, 0.0),
        (TABLE, "d(i)/dt", "mA/s", 1e-3, 0.0),
        (BOILER, "T", "degC", 274.15, 273.15),
        (BOILER, "d(T)/dt", "K/s", 1.0, 0.0),
        (BOILER_F, "d(T)/dt", "degF/s", 5 / 9, 0.0),
        (SLIDE, "v", None, 0.0, 0.0),
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
    system = system_of(TABLE, tmp_path)
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
    (region,) = regions_in_columns(system_of(BOILER, tmp_path), [row])
    assert (region["low"], region["high"], region["share"]) == pytest.approx((27.0, 37.0, 0.4))
    other = {"signal": "nothing", "low": 1.0, "high": 2.0, "share": 0.4}
    assert regions_in_columns(system_of(BOILER, tmp_path), [other]) == [other]


def test_the_page_shows_outputs_in_the_units_of_their_columns(tmp_path: Path) -> None:
    system = system_of(BOILER, tmp_path)
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
    plain = system_of(SLIDE, tmp_path)
    assert about_machine(plain)["outputs"] == [{"name": "x", "unit": "m"}]


@pytest.mark.parametrize(
    ("text", "where", "number", "said"),
    [
        (BOILER, (*LOSS, WALL), ("x_a", 297.15), "x_a = 24 degC"),
        (TABLE, (*PLAY, PORT), ("delta", pi / 180), "2·delta = 2 deg"),
        (SLIDE, (*PART, BELT), ("omega_f", 14 * pi), "omega_f/(2·pi) = 7 Hz"),
    ],
)
def test_a_slider_says_its_number_as_the_sentences_do(
    tmp_path: Path, text: str, where: tuple[str, str, Place], number: tuple[str, float], said: str
) -> None:
    name, value = number
    one = _as_said(found(system_of(text, tmp_path), *where, {name: value}).added, name)["said"]
    assert f"{one['symbol']} = {one['slope'] * value + one['shift']:.10g} {one['unit']}" == said


def test_pages_of_a_training_and_of_a_simulation_say_errors_in_the_units_of_the_columns(
    tmp_path: Path,
) -> None:
    item = system_of(TABLE, tmp_path).outputs[0]
    off = Off("rad", pi / 180, None, item.as_difference)
    for entry in (simulated_errors(off), learned_errors(off, off)):
        assert (entry["unit"], entry["known"]) == ("rad", pi / 180)
        assert as_said(entry)["unit"] == "deg" and as_said(entry)["known"] == pytest.approx(1.0)
    plain = Off("m", 0.1, 0.2, system_of(SLIDE, tmp_path).outputs[0].as_difference)
    assert as_said(simulated_errors(plain)) == {"unit": "m", "known": 0.1, "known_whole_run": 0.2}
    assert learned_errors(plain, plain)["formulas_whole_run"] == 0.2


def test_a_law_with_several_numbers_or_a_signed_one_has_words_of_its_own(tmp_path: Path) -> None:
    """Otherwise a title would tell its first number and the name of the family."""
    without = []
    for _, added in added_somewhere(tmp_path):
        shared = [name for name in added.reported if name not in added.per_experiment]
        is_signed = any(added.bounds[name][0] < 0.0 for name in shared)
        if (len(shared) > 1 or is_signed) and not added.phrase and not added.delays:
            without.append(added.title)
        assert added.phrase.count("{") == sum(f"{{{name}}}" in added.phrase for name in added.reported)
    assert not without


@pytest.mark.parametrize(
    ("value", "words"),
    [(0.3, "stiffness of 0.3\xa0N\xa0m/rad"), (-0.3, "negative stiffness of 0.3\xa0N\xa0m/rad")],
)
def test_a_sign_that_changes_the_meaning_is_in_the_words(tmp_path: Path, value: float, words: str) -> None:
    told = content(
        found(system_of(TABLE, tmp_path), "linear_spring", "", Place("port", "gear"), {"k_gear": value})
    )
    assert told["text"].startswith(words)
