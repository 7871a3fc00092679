"""Limits are in the units of the columns: what is written for a machine keeps them, in every unit."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import Array, changed, system_of, text_of
from unmodelled.api.plan import plan
from unmodelled.base.errors import BadInput
from unmodelled.cli.verbs.plan import plan as plan_verb
from unmodelled.design.limits import Limits, far_from_logs, read_limits
from unmodelled.design.plan_content import _effect, _size, effects_table
from unmodelled.design.planned import read_inputs
from unmodelled.design.runs import Simulated
from unmodelled.design.signals import FAMILIES
from unmodelled.design.visible import Visible
from unmodelled.design.written import write_experiment
from unmodelled.effects.actuator_offset import ActuatorOffset
from unmodelled.effects.place import Place
from unmodelled.effects.scales import Scales, Spread
from unmodelled.logs.logs import Logs
from unmodelled.systems import units
from unmodelled.systems.model import Logged, System
from unmodelled.systems.units import LoggedUnit, parse_logged

#: Spellings beside those of the unit registry: prefixes, powers, quotients, signs.
SPELLED = (
    *("mA", "kW", "µV", "mm", "um", "MPa", "mbar", "GHz", "mN m", "kN", "Nm", "mNm", "deg/s", "rpm", "%", ""),
    *("°C", "°F", "mm/s^2", "m/s²", "L/min", "km/h", "1/min", "MW", "count", "-", "mK", "degC/s", "kg mm^2"),
)
LIMITS = """
duration: 2
period: 0.02
inputs: {{q: {{low: {low!r}, high: {high!r}, rate: {rate!r}}}}}
travel: {{h: {{low: {low!r}, high: {high!r}, speed: {rate!r}}}}}
start: {{h: {start!r}}}
operating_point: {{load: {start!r}}}
noise: {{h: {noise!r}}}
"""
#: Numbers of the limits.
GIVEN = {"low": -3.0, "high": 12.5, "rate": 40.0, "start": 2.0, "noise": 0.25}


def known_units() -> list[str]:
    """Every unit that a system file may give to a column."""
    found = []
    for name in dict.fromkeys((*SPELLED, *dir(units._registry()))):
        try:
            parse_logged(name)
        except ValueError:
            continue
        found.append(name)
    return found


@pytest.fixture(scope="module")
def tank(tmp_path_factory: pytest.TempPathFactory) -> System:
    return system_of(text_of("loaded_tank.yaml"), tmp_path_factory.mktemp("tank"))


def unmoved(_: Array) -> tuple[Simulated, ...]:
    """Models that travel limits do not concern."""
    return ()


def in_unit(system: System, name: str) -> System:
    """The system with its signals and constants written in a unit."""
    unit, logged = parse_logged(name)

    def written(items: Iterable[Any]) -> tuple[Any, ...]:
        return tuple(replace(item, unit=unit.text, logged=logged) for item in items)

    every = ("inputs", "outputs", "operating_point")
    return replace(system, **{name: written(getattr(system, name)) for name in every})


def read(folder: Path, system: System, **numbers: float) -> Limits:
    (folder / "limits.yaml").write_text(LIMITS.format(**{**GIVEN, **numbers}))
    return read_limits(folder / "limits.yaml", system)


def to_si(item: Logged, value: float) -> float:
    return value if item.logged is None else float(item.logged.to_si(np.asarray(value)))


USUAL = pytest.param((*SPELLED, "degF", "inch"), id="usual")


@pytest.mark.parametrize("names", [USUAL, pytest.param(known_units(), marks=pytest.mark.long, id="all")])
def test_every_unit_is_written_within_its_limits(tank: System, tmp_path: Path, names: Sequence[str]) -> None:
    assert {"mA", "°C", "degF", "%", "count"} <= set(names) and len(set(names)) >= 30
    z = np.random.default_rng(0).random((1, FAMILIES[0].size))
    z[0, :4] = 1.0, 0.5, 1.0, 0.0  # the whole range: up, then down
    for name in names:
        system = in_unit(tank, name)
        limits, item = read(tmp_path, system), system.inputs[0]
        written = limits.written[0]
        assert (written.low, written.high, written.rate) == (-3.0, 12.5, 40.0), name
        low, high, level = (to_si(item, value) for value in (-3.0, 12.5, 2.0))
        own, factor = limits.inputs[0], to_si(item, 1.0) - to_si(item, 0.0)
        assert (own.low, own.high) == pytest.approx((low, high), rel=1e-12), name
        # a change has no offset: 40 degC/s are 40 K/s
        assert own.rate == pytest.approx(40.0 * factor, rel=1e-9), name
        assert limits.noise["h"] == pytest.approx(0.25 * factor, rel=1e-9), name
        assert limits.start["h"] == limits.constants["load"] == pytest.approx(level, rel=1e-12), name
        assert limits.travel["h"].low == pytest.approx(low, rel=1e-12), name
        for family in FAMILIES[:2]:
            u = family.inputs(z, limits)[0]
            write_experiment(u, system, limits, tmp_path / "experiment.csv", unmoved)
            table = pd.read_csv(tmp_path / "experiment.csv")  # what a machine would run
            assert table["q"].between(-3.0 - 1e-7, 12.5 + 1e-7).all(), name
            assert np.abs(np.diff(table["q"])).max() <= 40.0 * 0.02 + 1e-6, name
            assert table["q"].iloc[0] == table["q"].iloc[-1] == 0.0, name  # the zero of its own scale
            assert np.ptp(table["q"]) > 1.0, name
            still = replace(limits, travel={})
            (again,) = read_inputs(tmp_path / "experiment.csv", system, still).values()
            np.testing.assert_allclose(again, u, rtol=0, atol=1e-8 * (np.abs(u).max() + abs(to_si(item, 0))))


@pytest.mark.parametrize("name", ["dB", "dBm", "octave", "decade", "neper"])
def test_a_logarithmic_unit_is_no_unit_of_a_column(name: str) -> None:
    with pytest.raises(ValueError, match="logarithmic"):
        parse_logged(name)


@pytest.mark.parametrize(("name", "factor"), [("mA", 1000.0), ("degC", 1.0), ("%", 100.0), ("kW", 1000.0)])
def test_an_experiment_in_wrong_units_is_not_kept(
    tank: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, factor: float
) -> None:
    """Even if a conversion of the program were wrong, nothing beyond the limits would be left on the disk."""
    system = in_unit(tank, name)
    limits = read(tmp_path, system)
    u = FAMILIES[0].inputs(np.full((1, FAMILIES[0].size), 0.9), limits)[0]
    monkeypatch.setattr(LoggedUnit, "from_si", lambda self, values: values * factor + 300.0)
    with pytest.raises(BadInput, match=r"experiment.csv: row \d+: column q: .* beyond the limits") as error:
        write_experiment(u, system, limits, tmp_path / "experiment.csv", unmoved)
    assert "\n" not in str(error.value) and not (tmp_path / "experiment.csv").exists()
    monkeypatch.setattr(LoggedUnit, "from_si", lambda self, values: 0.0 * values + 1.0)
    with pytest.raises(BadInput, match="other inputs than designed"):
        write_experiment(u, system, limits, tmp_path / "experiment.csv", unmoved)
    assert not (tmp_path / "experiment.csv").exists()


@pytest.mark.parametrize(
    ("most", "message"),
    [(13.0, r"row 3: column q: 13 % is beyond the limits -3 to 12.5 %"), (9.0, "faster")],
)
def test_a_given_experiment_must_keep_the_limits(
    tank: System, tmp_path: Path, most: float, message: str
) -> None:
    system = in_unit(tank, "%")
    limits = read(tmp_path, system)
    pd.DataFrame({"t": [0.0, 0.1, 0.2], "q": [0.0, most, 0.0]}).to_csv(tmp_path / "mine.csv", index=False)
    with pytest.raises(BadInput, match=message):
        read_inputs(tmp_path / "mine.csv", system, limits)


@pytest.mark.parametrize("name", ["duration", "period", "rate", "noise"])
@pytest.mark.parametrize(
    "value", ["1e308", "-1e308", "1e-320", "0", "1e999", "nan", ".inf", "[]", "{}", "text", ""]
)
def test_a_number_that_no_experiment_has_is_one_line(
    tank: System, tmp_path: Path, name: str, value: str
) -> None:
    text = LIMITS.format(**GIVEN)
    old = {"duration": "2", "period": "0.02", "rate": "40.0", "noise": "{h: 0.25}"}[name]
    new = f"{{h: {value}}}" if name == "noise" else value
    (tmp_path / "limits.yaml").write_text(changed(text, (f"{name}: {old}", f"{name}: {new}")))
    with pytest.raises(BadInput) as error:
        read_limits(tmp_path / "limits.yaml", in_unit(tank, "mA"))
    line = str(error.value)
    assert "\n" not in line and str(tmp_path / "limits.yaml") in line
    assert len(line.replace(str(tmp_path), "")) < 200


def test_the_start_is_within_the_travel_in_the_unit_of_the_column(tank: System, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="h starts at 20 degC, outside of its travel"):
        read(tmp_path, in_unit(tank, "degC"), start=20.0)


def test_a_temperature_without_a_start_is_asked_for(tank: System, tmp_path: Path) -> None:
    text = changed(LIMITS.format(**GIVEN), ("start: {h: 2.0}", ""))
    (tmp_path / "limits.yaml").write_text(text)
    with pytest.raises(BadInput, match=r"h has no start: add start: \{h: ...\} \(degC\)"):
        read_limits(tmp_path / "limits.yaml", in_unit(tank, "degC"))
    assert read_limits(tmp_path / "limits.yaml", tank).start == {}


def test_limits_in_another_unit_than_the_logs_are_a_note(tank: System, tmp_path: Path) -> None:
    system = in_unit(tank, "degC")
    t = 0.02 * np.arange(100)
    frame = pd.DataFrame({"t": t, "q": 20.0 + np.sin(t), "h": 25.0 + np.cos(t)})
    table = pd.DataFrame({"load": [2.0, 2.0]}, index=["a", "b"])
    logs = Logs.from_frames({"a": frame, "b": frame}, system, table)
    assert far_from_logs(read(tmp_path, system, low=18.0, high=24.0, start=20.0), system, logs) == []
    (note,) = far_from_logs(read(tmp_path, system, low=291.0, high=297.0, start=293.0), system, logs)
    assert "the limits of q are 291 to 297 degC, the logs have 20 to 21: check their unit" in note


OF_THE_ROOM = """
duration: 400
period: 4
inputs: {P: {low: 0, high: 3, rate: 0.5}, T_out: {low: 18, high: 22, rate: 0.1}, valve: {low: -90, high: 90}}
travel: {T: {low: 5, high: 80, speed: 2}}
start: {T: 20}
noise: {T: 0.02}
"""


@pytest.mark.long
def test_a_plan_is_written_and_told_in_the_units_of_the_user(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    system = system_of(text_of("heated_room.yaml"), tmp_path)
    (tmp_path / "limits.yaml").write_text(OF_THE_ROOM)
    plan_verb(tmp_path / "system.yaml", tmp_path / "limits.yaml", None, tmp_path / "out")
    said = capsys.readouterr().out
    assert "P 0 to 3 kW, at most 0.5 kW/s; T_out 18 to 22 degC, at most 0.1 degC/s; valve −90 to 90 %" in said
    files = sorted((tmp_path / "out" / "experiments").glob("*.csv"))
    assert len(files) >= 8
    for file in files:
        table = pd.read_csv(file)
        assert table["P"].between(0.0, 3.0).all() and table["T_out"].between(18.0, 22.0).all()
        assert table["valve"].between(-90.0, 90.0).all()
        assert table["T_out"].diff().abs().max() <= 0.1 * 4 + 1e-6
    assert max(pd.read_csv(file)["valve"].abs().max() for file in files) > 20.0
    found = plan(system, tmp_path / "limits.yaml", tmp_path / "out" / "experiments")
    assert found.content["start"] == {"T": {"value": 20.0, "unit": "degC"}}
    assert found.content["noise"] == {"T": {"value": 0.02, "unit": "degC"}}


def test_a_size_that_shows_is_told_in_the_units_of_the_logs(tmp_path: Path) -> None:
    """An offset of the valve in percent, and the play of a screw from stop to stop in mm."""
    system = system_of(text_of("heated_room.yaml"), tmp_path)
    scales = Scales(
        {"T": Spread(290.0, 300.0, 295.0), **{i.name: Spread(0.0, 1.0, 0.5) for i in system.inputs}},
        *({"T": Spread(290.0, 300.0, 295.0)}, {"wall": 50.0}, {"wall": 0.0}, 4.0, 400.0),
    )
    added = ActuatorOffset().add(system, Place("actuator", "valve"), scales)
    one = Visible(added, "u_0", 0.031, 0.1, np.zeros(1), ())
    entry = _effect(one, ())
    assert (entry["size"], entry["unit"]) == (0.031, "1") and entry["shown"]["size"] == pytest.approx(3.1)
    row = effects_table({"effects": [entry]}).iloc[0]
    assert (row["size"], row["unit"]) == (pytest.approx(3.1), "%")
    assert _size(entry).replace("\xa0", " ").startswith("3.1 % (10")
