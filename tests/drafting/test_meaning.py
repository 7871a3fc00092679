"""What names, units and values say, and odd ones: init prints them safely, and what it writes is read."""

import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.drafting.test_init import INERTIA, LOGS, columns_of, drafted, put, servo, values, write
from unmodelled.api.simulation import simulate
from unmodelled.base.errors import BadInput
from unmodelled.cli.verbs.init import init
from unmodelled.drafting.lines import quoted
from unmodelled.drafting.names import Role, meaning_of
from unmodelled.logs.folder import read_logs
from unmodelled.logs.mapping import read_mapping
from unmodelled.systems.reader import read_system

#: Names with their units by what they mean.
MEANINGS = {
    Role.TEMPERATURE: {
        **{"T_oven_degC": "degC", "Temp2 (°C)": "°C", "temp_c": "degC", "Tw": None, "yTs": None},
        **{"Inlet Temp [C]": "degC", "return [C]": None, "probe (\u2103)": "degC", "TI-31": None},
    },
    Role.POWER: {"P_el_kW": "kW", "laser power [mW]": "mW", "Pe": None, "JT_40 [kW]": "kW"},
    Role.PRESSURE: {"p_A_bar": "bar", "supply_MPa": "MPa", "PDT07 [mbar]": "mbar"},
    Role.FLOW: {
        "flow_l_min": "l/min",
        "Q_in [m3/h]": "m^3/h",
        "FT-12A [kg/s]": "kg/s",
        "FIC_11.PV": None,
        "FT2 [L/min]": "L/min",
    },
    Role.POSITION: {
        **{"z_stage": None, "heading": None},
        **{"theta_m": None, "theta_m_deg": "deg", "x_m": "m", "pos_min": None, "pos_a": None},
        **{"Inc": "count", "pos_cnt": "count", "enc ticks": "count", "gear position [V]": "V"},
    },
    Role.CURRENT: {"ESC.Curr": None, "i_q": None, "iMotor_mA": "mA", "i_cmd_mA": "mA", "tank_supply_A": "A"},
    Role.VELOCITY: {
        **{"speedRPM": "rpm", "n [1/min]": "rpm", "spindle speed 1/min": None, "vel_deg_per_s": "deg/s"},
        **{
            "gyrZ": None,
            "gyro_y_dps": "deg/s",
            "GyroADC[2]": None,
            "tilt_rate": None,
            "pose_position.vx": None,
        },
        **{"ST101 [rpm]": "rpm"},
    },
    Role.TIME: {"time_h": None, "t_ms": "ms", "Zeit [min]": "min", "datenum": None},
    Role.DUTY: {"pump_%": "%", "valve position [%]": "%", "duty_cycle": None, "PCV301 [%]": "%"},
    Role.LEVEL: {
        "tank level mm": "mm",
        "Füllstand [%]": "%",
        "LI-204B [mm]": "mm",
        "LIC55_PV": None,
        "LT1 [cm]": "cm",
    },
    Role.PART: {"cycle": None, "trial no": None},
    Role.SET_POINT: {"T_set": None, "PIC20/SP": None, "room temp sp": None},
    Role.GOAL: {"pos_set_mm": "mm", "soll [deg]": "deg"},
    Role.EFFORT: {"motor load [N m]": "N m", "FT1 [N]": "N"},
    Role.OTHER: {
        **{"torque_enable": None, "current limit": None, "i_q_offset_A": "A", "gyro_bias[2]": None},
        **{"acc_x": None, "LSH12": None},
    },
}


@pytest.mark.parametrize("role", MEANINGS)
def test_names_are_read_by_whole_words(role: Role) -> None:
    for name, unit in MEANINGS[role].items():
        found = meaning_of(name)
        assert (name, found.role, found.unit) == (name, role, unit)


#: Names of columns by the sizes of their numbers, and the units beside.
NUMBERED = {
    "angle (0.1 deg)": ("deg", 0.1),
    "angle [1/100 rad]": ("rad", 0.01),
    "angle [mrad/10]": ("mrad", 0.1),
    "angle [deg]": ("deg", 1.0),
}


@pytest.mark.parametrize("name", NUMBERED)
def test_a_number_beside_a_unit_scales_a_column(name: str, tmp_path: Path) -> None:
    unit, factor = NUMBERED[name]
    size = {"deg": np.pi / 180.0, "rad": 1.0, "mrad": 1e-3}[unit] * factor
    logs = write(tmp_path / "raw", {"t": "t", name: "angle", "torque_Nm": "torque"}, angle=1.0 / size)
    mapping, system = drafted(logs)
    scale = {} if factor == 1.0 else {"scale": factor}
    assert mapping["signals"]["q"] == {"column": name, "unit": unit, **scale}
    assert ("# Question: is one" in (logs / "mapping.yaml").read_text()) == bool(scale)
    np.testing.assert_allclose(read_logs(logs, system).y[:1500, 0], LOGS[0]["angle"], atol=1e-9)


def test_every_column_that_is_left_out_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for k, log in enumerate(LOGS[:3]):
        t = np.asarray(log["t"])
        columns = {"t": t, "angle [rad]": log["angle"], "torque [N m]": log["torque"], "Status": 0.0 * t}
        columns |= {"elapsed_ms": 1e3 * t, "tool": np.where(t < 1.0, "a", "b"), "empty": np.nan * t}
        columns["rare"] = np.where(np.arange(len(t)) % 200, np.nan, t)
        (tmp_path / "raw").mkdir(exist_ok=True)
        pd.DataFrame(columns).to_csv(tmp_path / f"raw/run{k}.csv", index=False)
    init(tmp_path / "raw", None, None, None)
    told = [line for line in capsys.readouterr().out.splitlines() if line.startswith("left out, ")]
    assert sorted(told) == [
        "left out, another clock: elapsed_ms",
        "left out, fewer than 20 values: rare",
        "left out, no number: empty",
        "left out, one value in a file: Status",
        "left out, text: tool",
    ]


def test_counts_are_scaled_with_a_question(tmp_path: Path) -> None:
    columns = {"t": "t", "enc_cnt": "angle", "torque_Nm": "torque"}
    logs = write(tmp_path / "raw", columns, angle=8192.0 / (2.0 * np.pi))
    mapping, system = drafted(logs)
    assert mapping["signals"]["q"] == {"column": "enc_cnt", "unit": "turn", "scale": "1/4096"}
    assert "# Question: how many counts a turn?" in (logs / "mapping.yaml").read_text()
    np.testing.assert_allclose(read_logs(logs, system).y[:1500, 0], 2.0 * LOGS[0]["angle"], atol=1e-9)


def test_a_speed_beside_counts_gives_their_scale(tmp_path: Path) -> None:
    columns = {"t": "t", "ticks": "angle", "speed_rpm": "speed", "torque_Nm": "torque"}
    logs = write(tmp_path / "raw", columns, angle=2000.0 / (2.0 * np.pi), speed=30.0 / np.pi)
    mapping, system = drafted(logs)
    assert float(mapping["signals"]["q"]["scale"].removeprefix("1/")) == pytest.approx(2000.0, rel=0.01)
    assert "by speed_rpm" in (logs / "mapping.yaml").read_text()
    assert values(system)["J"] == pytest.approx(INERTIA, rel=0.05)


def test_a_gyro_in_degrees_tells_the_last_digit_of_an_angle(tmp_path: Path) -> None:
    """A bias beside them, which drifts, drives nothing."""
    columns = {"timeUS": "t", "heading": "angle", "GyrZ": "speed", "rudder": "torque"}
    degree = 180.0 / np.pi
    logs = write(tmp_path / "raw", columns, t=1e6, angle=100.0 * degree, speed=degree)
    for path in logs.iterdir():
        table = pd.read_csv(path).round({"heading": 0, "timeUS": 0})
        table.assign(gyro_bias=1e-3 * np.cumsum(table["rudder"])).to_csv(path, index=False)
    mapping, system = drafted(logs)
    assert mapping["signals"] == {
        "q": {"column": "heading", "unit": "deg", "scale": 0.01},
        "w": {"column": "GyrZ", "unit": "deg/s"},
        "u": {"column": "rudder", "unit": "N m"},
    }
    text = (logs / "mapping.yaml").read_text()
    assert "# Question: is one 0.01 deg? It is by GyrZ." in text and "# Question: is it in deg/s?" in text
    assert values(system)["J"] == pytest.approx(INERTIA, rel=0.05)


@pytest.mark.parametrize("rate", [1.0, 180.0 / np.pi])
def test_a_symbol_that_is_the_slope_is_a_speed(tmp_path: Path, rate: float) -> None:
    """p is a roll rate in flight mechanics; a column that is the only one beside an angle drives it."""
    columns = {"t": "t", "roll_rad": "angle", "p": "speed", "aileron": "torque"}
    mapping, _ = drafted(write(tmp_path / "raw", columns, speed=rate))
    assert columns_of(mapping) == {"q": "roll_rad", "w": "p", "u": "aileron"}
    assert mapping["signals"]["w"]["unit"] == ("rad/s" if rate == 1.0 else "deg/s")
    alone = {name: own for name, own in columns.items() if own != "torque"}
    assert columns_of(drafted(write(tmp_path / "alone", alone))[0]) == {"q": "roll_rad", "u": "p"}


def test_a_clock_whose_name_tells_too_fast_a_rate_is_a_question(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"us": "t", "phi": "angle", "torque": "torque"})
    mapping, _ = drafted(logs)
    assert mapping["time"] == {"column": "us", "unit": "us"}
    assert "# Question: is it in us (2.5e+08 samples a second)?" in (logs / "mapping.yaml").read_text()


def test_the_system_file_speaks_the_units_of_the_recorder(tmp_path: Path) -> None:
    columns = {"t": "t", "pan_deg": "angle", "pan rpm": "speed", "winding (mA)": "torque"}
    logs = write(tmp_path / "raw", columns, angle=180.0 / np.pi, speed=30.0 / np.pi, torque=1e3)
    _, system = drafted(logs)
    items = [*system.outputs, *system.inputs]
    assert [item.column_unit for item in items] == ["deg", "rpm", "mA"]
    assert [state.unit for state in system.states] == ["rad", "rad/s"]
    read = read_logs(logs, system)
    np.testing.assert_allclose(read.y[:1500, 0], LOGS[0]["angle"], atol=1e-9)


def test_counts_that_a_force_drives_are_lengths(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "slide cnt": "angle", "push (N)": "torque"}, angle=1e5)
    mapping, system = drafted(logs)
    assert mapping["signals"]["q"] == {"column": "slide cnt", "unit": "m", "scale": "1/1000000"}
    assert "# Question: how many counts a metre? 1000000 is a guess." in (logs / "mapping.yaml").read_text()
    assert system.outputs[0].unit == "m"


@pytest.mark.parametrize(
    ("position", "wanted"), [("carriage pos", ["m", "m/s", "N"]), ("pole tilt", ["rad", "rad/s", "N m"])]
)
def test_what_a_force_drives_is_a_length_unless_its_name_is_that_of_an_angle(
    tmp_path: Path, position: str, wanted: list[str]
) -> None:
    """A speed without a unit beside them says nothing else."""
    columns = {"t": "t", position: "angle", "vel": "speed", "F": "torque"}
    _, system = drafted(write(tmp_path / "raw", columns))
    assert [item.unit for item in (*system.outputs, *system.inputs)] == wanted


@pytest.mark.parametrize(("factor", "unit"), [(1.0, "rad/s"), (180.0 / np.pi, "deg/s")])
def test_a_gyro_alone_turns_in_degrees_or_radians_a_second(tmp_path: Path, factor: float, unit: str) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "gyroY": "speed", "cur": "torque"}, speed=10.0 * factor)
    mapping, _ = drafted(logs)
    assert mapping["signals"]["w"] == {"column": "gyroY", "unit": unit}
    assert f"# Question: is it in {unit}?" in (logs / "mapping.yaml").read_text()


def test_ticks_that_grow_evenly_are_a_clock(tmp_path: Path) -> None:
    """In milliseconds or another unit, which is asked; ticks of an encoder do not grow so evenly."""
    logs = write(tmp_path / "raw", {"ticks": "t", "phi": "angle", "torque": "torque"}, t=1e3)
    for path in logs.iterdir():
        table = pd.read_csv(path)
        table.assign(ticks=91_000 + table["ticks"].round().astype(int)).to_csv(path, index=False)
    mapping, _ = drafted(logs)
    assert mapping["time"] == {"column": "ticks", "unit": "ms"} and columns_of(mapping)["q"] == "phi"
    assert "# Question: is it in ms (250 samples a second)?" in (logs / "mapping.yaml").read_text()


def test_a_sensor_in_volts_is_scaled_with_a_question(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "potentiometer angle [V]": "angle", "torque": "torque"})
    mapping, system = drafted(logs)
    assert mapping["signals"]["q"]["scale"] == 1 and mapping["signals"]["q"]["unit"] == "rad"
    assert "# Question: which rad is one V?" in (logs / "mapping.yaml").read_text()
    assert np.isfinite(simulate(system, read_logs(logs, system)).gap.value)


def test_two_encoders_of_a_gear_are_one_chain(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "motor_deg": "angle", "torque": "torque"}, angle=180.0 / np.pi)
    for path in logs.iterdir():
        table = pd.read_csv(path)
        table.assign(table_deg=table["motor_deg"] / 7.25 + 12.0).to_csv(path, index=False)
    mapping, system = drafted(logs)
    assert mapping["signals"].keys() == {"q", "u"} and len(system.outputs) == 1
    text = (logs / "mapping.yaml").read_text()
    assert "# Question: table_deg is 0.1379 = 1/7.25 times motor_deg all the time: two encoders" in text


def test_joints_that_were_moved_alike_stay_two(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "pos_1": "angle", "tau_1": "torque", "tau_2": "torque"})
    for path in logs.iterdir():
        table = pd.read_csv(path)
        table.assign(pos_2=0.5 * table["pos_1"]).to_csv(path, index=False)
    mapping, _ = drafted(logs)
    assert mapping["signals"].keys() == {"q1", "u1", "q2", "u2"}


def test_a_speed_of_another_shaft_is_a_question(tmp_path: Path) -> None:
    columns = {"t": "t", "angle_deg": "angle", "rotor_rpm": "speed", "torque": "torque"}
    logs = write(tmp_path / "raw", columns, angle=180.0 / np.pi, speed=7.0 * 30.0 / np.pi)
    mapping, _ = drafted(logs)
    assert mapping["signals"].keys() == {"q", "u"}
    assert "# Question: rotor_rpm is 7" in (logs / "mapping.yaml").read_text()


def test_what_acts_goes_before_a_set_point(tmp_path: Path) -> None:
    columns = {"t": "t", "x_mm": "angle", "x_ref_mm": "angle"}
    columns |= {"force_meas_N": "torque", "force_cmd_N": "torque"}
    logs = write(tmp_path / "raw", columns, angle=100.0)
    mapping, _ = drafted(logs)
    assert mapping["signals"]["u"]["column"] == "force_meas_N"
    text = (logs / "system.yaml").read_text()
    assert "# x_ref_mm is the set point of q: the loop is closed" in text
    assert "u: {unit: N, commanded: false}" in text


def test_a_set_point_alone_says_that_the_loop_is_closed(tmp_path: Path) -> None:
    logs = map(servo, range(2))
    mm = ({"t": each["t"], "lift_mm": 1e3 * each["q"], "lift_target_mm": 1e3 * each["goal"]} for each in logs)
    mapping, _ = drafted(put(tmp_path, mm))
    assert mapping["signals"]["u"] == {"column": "lift_target_mm", "unit": "mm"}
    assert "u is a set point: the loop is closed" in (tmp_path / "system.yaml").read_text()


def test_a_supply_voltage_does_not_replace_a_set_point(tmp_path: Path) -> None:
    tables = []
    for k, log in enumerate(map(servo, range(2))):
        supply = 12.0 + 0.05 * np.random.default_rng(k).standard_normal(len(log["t"]))
        tilt = {"tilt_rad": log["q"], "tilt_target_rad": log["goal"]}
        tables.append({"t": log["t"], **tilt, "supply_V": supply})
    mapping, system = drafted(put(tmp_path, tables))
    assert mapping["signals"]["u"]["column"] == "tilt_target_rad"
    assert values(system)["K"] == pytest.approx(64.0, rel=0.1)


def test_the_drives_of_all_joints_are_of_one_kind(tmp_path: Path) -> None:
    """The measured torque of the second joint is noisy, which is no reason to mix it with a command."""
    tables = []
    for k in range(3):
        one, other = LOGS[k], LOGS[(k + 1) % 3]
        noise = 0.3 * np.random.default_rng(k).standard_normal(len(one["t"]))
        joints = {"pos1": one["angle"], "pos2": other["angle"]}
        measured = {"tau_meas1": one["torque"] + 0.05 * noise, "tau_meas2": other["torque"] + noise}
        wanted = {"tau_cmd1": one["torque"], "tau_cmd2": other["torque"]}
        tables.append({"t": one["t"], **joints, **measured, **wanted})
    found = columns_of(drafted(put(tmp_path, tables))[0])
    assert (found["u1"], found["u2"]) in (("tau_meas1", "tau_meas2"), ("tau_cmd1", "tau_cmd2"))


NAMES = (
    *("a: b, {c}", "'single' and \"double\"", "# no comment", "50 % [x]", "- dash", "line\nbreak"),
    *("\x1b]0;title\x07", "\x7f\x85\u2028\ufeff", "yes", "null", "1e5", "Drehgeber \u00fc \U0001f600"),
    *("C:\\raw\\n", "*star", "&anchor", "!tag", "? key", "@at", "`mark`"),
)
UNITS = ("%", "N m", "mA", "1", "-", "kg m^2/s^2", "N·m", "°", "µm", "degC", "bar", "1/min", "m³/h", "V")


@settings(max_examples=100, deadline=None)
@given(text=st.text(st.characters(codec="utf-8"), min_size=1), unit=st.sampled_from(UNITS))
def test_any_text_is_read_back(tmp_path_factory: pytest.TempPathFactory, text: str, unit: str) -> None:
    file = tmp_path_factory.mktemp("one") / "mapping.yaml"
    signal = f"{{column: {quoted(text)}, unit: {quoted(unit)}}}"
    lines = ["schema: mapping/1", f"files: {quoted(text)}", f"signals: {{q: {signal}}}"]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    mapping = read_mapping(file)
    assert mapping.files == (text,)
    assert (mapping.signals["q"].column.name, mapping.signals["q"].unit) == (text, unit)


@pytest.mark.parametrize("quantity", ["angle", "torque", "level", "temp"])
@pytest.mark.parametrize("unit", [*UNITS, "turn", "count", "psi", "kg", "lbf", "Hz", "dB", "%RH", "foo"])
def test_whatever_the_unit_the_next_command_reads_the_files(tmp_path: Path, unit: str, quantity: str) -> None:
    """A position in kilograms is none, and is refused; everything that is written is read."""
    beside = "torque" if quantity in ("angle", "torque") else "flow"
    for k, log in enumerate(LOGS[:2]):
        columns = {"t": log["t"], beside: log["torque"]}
        if quantity == "torque":
            columns = {"t": log["t"], "angle": log["angle"]}
        own = log["torque" if quantity == "torque" else "angle"]
        pd.DataFrame({**columns, f"{quantity} [{unit}]": own}).to_parquet(tmp_path / f"{k}.parquet")
    try:
        init(tmp_path, None, None, None)
    except BadInput as refused:
        assert "no moving position and no level" in str(refused)
        assert not (tmp_path / "mapping.yaml").exists()
        return
    logs = read_logs(tmp_path, read_system(tmp_path / "system.yaml"))
    assert np.isfinite(logs.y).all() and np.isfinite(logs.u).all()


@pytest.mark.parametrize("name", NAMES)
def test_columns_with_odd_names_are_read_by_what_is_written(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for k, log in enumerate(LOGS):
        columns = {"t": log["t"], f"theta {name}": log["angle"], f"torque {name}": log["torque"]}
        pd.DataFrame(columns).to_parquet(tmp_path / f"{k}.parquet")
    _, system = drafted(tmp_path)
    logs = read_logs(tmp_path, system)
    np.testing.assert_allclose(logs.y[:, 0], np.concatenate([log["angle"] for log in LOGS]), atol=1e-12)
    assert all(line.isprintable() for line in capsys.readouterr().out.splitlines())


def test_a_file_whose_name_has_control_characters_is_left_out(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "theta": "angle", "torque": "torque"})
    (logs / "run 1.csv").rename(logs / "run\x1b[2J\n1.csv")
    _, system = drafted(logs)
    assert read_logs(logs, system).ids == ("run 0", "run 2")
    assert "(its name has a control character: rename it)" in (logs / "mapping.yaml").read_text()


def test_logs_whose_names_all_have_control_characters_are_refused(tmp_path: Path) -> None:
    logs = tmp_path / "a\nb.csv"
    pd.DataFrame(LOGS[0]).to_csv(logs, index=False)
    with pytest.raises(BadInput, match="its name has a control character: rename it") as caught:
        init(logs, None, None, None)
    assert str(caught.value).isprintable() and len(list(tmp_path.iterdir())) == 1


def test_the_next_command_can_be_pasted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logs = write(tmp_path / "day 1's (north)", {"t": "t", "theta": "angle", "torque": "torque"})
    init(logs, None, None, None)
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("next: "))
    escaped = str(logs).replace("'", "\\'")
    assert shlex.split(line)[3:] == [f"system='{escaped}/system.yaml'", f"logs='{escaped}'", "out=simulation"]


@pytest.mark.parametrize("out", ["raw", "."])
def test_the_folder_of_the_logs_may_be_named(
    tmp_path: Path, out: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path / "raw", {"t": "t", "theta": "angle", "torque": "torque"})
    monkeypatch.chdir(tmp_path if out == "raw" else tmp_path / "raw")
    init(Path(out), None, None, Path(out))
    assert (tmp_path / "raw" / "mapping.yaml").exists() and (tmp_path / "raw" / "system.yaml").exists()
