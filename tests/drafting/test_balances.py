"""Machines without moving positions: balances of heat, fluid, charge and momentum, and parts of records."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.drafting.test_init import LOGS, Array, columns_of, drafted, put, values
from unmodelled.api.simulation import simulate
from unmodelled.logs.folder import read_logs
from unmodelled.systems.model import System

N = 900
T = np.arange(N) * 1.0


def drive(seed: int, low: float, high: float, stretch: int = 60) -> Array:
    """Steps of random height."""
    generator = np.random.default_rng(seed)
    return np.repeat(generator.uniform(low, high, N // stretch), stretch)


def filled(
    supply: Array, size: float, loss: float, start: float, around: float = 0.0, step: float = 1.0
) -> Array:
    """The level of a store by Euler steps."""
    level = np.full(N, start)
    for n in range(1, N):
        level[n] = level[n - 1] + step * (supply[n - 1] - loss * (level[n - 1] - around)) / size
    return level


def drafted_days(
    folder: Path, day: Callable[[int], Mapping[str, Array]], days: int = 3, largest: float = 0.1
) -> tuple[dict[str, Any], System, str]:
    """Mapping, system and text of the system file of some days, which it predicts up to the largest gap."""
    logs = put(folder / "raw", map(day, range(days)), "day {}.csv")
    mapping, system = drafted(logs)
    assert simulate(system, read_logs(logs, system)).gap.value < largest
    return mapping, system, (logs / "system.yaml").read_text()


def test_a_relay_that_switches_often_shows_the_size_of_a_store(tmp_path: Path) -> None:
    """Cycles of some twenty samples: over a sixtieth of the record, 150 samples, the relay has its mean."""
    t = np.arange(9000.0)

    def day(k: int) -> Mapping[str, Array]:
        relay, oven = np.zeros(len(t)), np.full(len(t), 350.0 + k)
        for n in range(1, len(t)):
            relay[n] = 800.0 * (oven[n - 1] < (352.0 if relay[n - 1] > 0.0 else 348.0))
            oven[n] = oven[n - 1] + (relay[n] - 5.0 * (oven[n - 1] - 290.0)) / 1500.0
        return {"seconds": t, "oven [K]": oven, "room [K]": 290.0 + 1e-3 * t, "heater [W]": relay}

    _, system = drafted(put(tmp_path / "raw", map(day, range(2)), "day {}.csv"))
    assert values(system)["C"] == pytest.approx(1500.0, rel=0.2)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_second_sensor_of_a_level_is_no_second_store(noise: float, tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        flow = drive(k, 0.0, 0.02)
        level = filled(flow, 0.5, 0.02, 0.4)
        second = 1e3 * level + 20.0 + 1e3 * noise * np.random.default_rng(k).standard_normal(N)
        return {"seconds": T, "LIC7.PV": second, "LT7 [m]": level, "FT8 [L/s]": 1e3 * flow}

    mapping, system, _ = drafted_days(tmp_path, day)
    assert [s["column"] for s in mapping["signals"].values()] == ["LT7 [m]", "FT8 [L/s]"]
    assert len(system.states) == 1
    asked = "LIC7.PV is 1000 times LT7 [m] with an offset and noise, and is left out. Is it the same level?"
    assert f"# Question: {asked}" in (tmp_path / "raw/mapping.yaml").read_text()


def test_an_oven_with_its_surroundings(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        power = drive(k, 0.0, 900.0)
        oven = filled(power, 1500.0, 4.0, 293.0, 291.0, 10.0)
        columns = {"oven_degC": oven - 273.15, "room_degC": np.full(N, 18.0) + 1e-3 * np.arange(N)}
        return {"minutes": np.arange(N) / 6.0, **columns, "P_el [kW]": power / 1e3}

    mapping, system, _ = drafted_days(tmp_path, day)
    assert mapping["time"] == {"column": "minutes", "unit": "min"}
    assert mapping["signals"] == {
        "T": {"column": "oven_degC", "unit": "degC"},
        "P": {"column": "P_el [kW]", "unit": "kW"},
        "T_a": {"column": "room_degC", "unit": "degC"},
    }
    assert values(system)["C"] == pytest.approx(1500.0, rel=0.05)
    assert values(system)["k"] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(("step", "unit"), [(300, "s"), (1000, "ms")])
def test_a_clock_without_a_unit_beside_temperatures(tmp_path: Path, step: int, unit: str) -> None:
    def day(k: int) -> Mapping[str, Array]:
        return {"t": step * np.arange(N), "Tb": 20.0 + drive(k, 0.0, 9.0), "Pb": drive(k + 5, 0.0, 50.0)}

    mapping, _ = drafted(put(tmp_path / "raw", map(day, range(2))))
    assert mapping["time"] == {"column": "t", "unit": unit}
    assert columns_of(mapping) == {"T": "Tb", "P": "Pb"}
    assert f"# Question: is it in {unit} (" in (tmp_path / "raw" / "mapping.yaml").read_text()


def test_surroundings_that_are_not_logged_are_asked(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        power = drive(k, 0.0, 50.0)
        return {"t": T, "plate temp (K)": filled(power, 120.0, 0.8, 300.0, 285.0), "power_W": power}

    _, system, text = drafted_days(tmp_path, day)
    assert "# Question: how warm are the surroundings?" in text
    assert values(system)["T_a"] == pytest.approx(285.0, abs=3.0)


def test_a_boiler_with_an_inflow_and_a_drain(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        fed, drained = drive(k, 0.0, 3.0), drive(k + 10, 0.0, 3.0)
        level = filled((fed - drained) / 6e4, 0.05, 0.0, 0.5)
        flows = {"feed_flow_l_min": fed, "drain_flow_l_min": drained}
        return {"time [s]": np.arange(N), "level_cm": 100.0 * level, **flows}

    mapping, system, text = drafted_days(tmp_path, day)
    assert columns_of(mapping) == {"h": "level_cm", "Q": "feed_flow_l_min", "Q_2": "drain_flow_l_min"}
    assert "h: (Q - Q_2 - k*h - x)/A" in text
    assert values(system)["A"] == pytest.approx(0.05, rel=0.05)


def test_tags_of_a_plant_tell_a_vessel(tmp_path: Path) -> None:
    """The valve at its outlet, and the controller of the level, are no force on a mass."""

    def day(k: int) -> Mapping[str, Array]:
        fed, opening = drive(k, 0.0, 3.0), drive(k + 10, 20.0, 80.0, 90)
        level = filled((fed - 1.5) / 3.6e3, 0.4, 0.0, 2.0)
        columns = {"LIC-07.PV [mm]": 1e3 * level, "FT-08 [m3/h]": fed, "LV-07 [%]": opening}
        return {"Time (min)": T / 60.0, **columns, "LIC-07.SP [mm]": drive(k + 20, 1e3, 3e3, 300)}

    mapping, system, text = drafted_days(tmp_path, day, largest=np.inf)
    assert mapping["signals"] == {
        "h": {"column": "LIC-07.PV [mm]", "unit": "mm"},
        "Q": {"column": "FT-08 [m3/h]", "unit": "m^3/h"},
    }
    assert "# LIC-07.SP [mm] is the set point of h" in text and "LV-07 [%]" in text
    assert [item.column_unit for item in (*system.outputs, *system.inputs)] == ["mm", "m^3/h"]


def test_an_air_receiver_with_a_valve(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        opening = drive(k, 0.0, 80.0)
        pressure = filled(opening, 4.0, 3.0, 2.0, 0.0, 0.05)
        return {"t_ms": np.arange(N) * 50.0, "valve_%": opening, "p_receiver_bar": pressure}

    mapping, _, text = drafted_days(tmp_path, day)
    assert mapping["signals"]["u"] == {"column": "valve_%", "unit": "%"}
    assert "# Question: which m^3/s does u = 1 (100 %) make?" in text and "position: p" in text


@pytest.mark.parametrize(("sign", "equation"), [(1.0, "z: (i - x)/C"), (-1.0, "z: (-i - x)/C")])
def test_a_capacitor_in_either_convention(tmp_path: Path, sign: float, equation: str) -> None:
    def day(k: int) -> Mapping[str, Array]:
        current = drive(k, -2.0, 2.0)
        voltage = filled(current, 300.0, 0.0, 20.0) + 0.03 * current
        return {"t": T, "u_cap [V]": voltage, "i_cap [A]": sign * current}

    _, system, text = drafted_days(tmp_path, day)
    assert equation in text
    assert values(system)["C"] == pytest.approx(300.0, rel=0.05)
    assert values(system)["R"] == pytest.approx(0.03, rel=0.1)


def test_a_state_of_charge(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        current = drive(k, -5.0, 3.0)
        soc = filled(current, 18000.0, 0.0, 0.8)
        return {"elapsed_s": T, "SOC [%]": 100.0 * soc, "I_pack_A": current}

    _, system, _ = drafted_days(tmp_path, day)
    assert values(system)["C"] == pytest.approx(18000.0, rel=0.05)


def test_a_machine_of_which_only_the_speed_is_logged(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        torque = drive(k, -3.0, 3.0)
        speed = filled(torque, 0.4, 0.2, 0.0, 0.0, 0.02)
        return {"t": 0.02 * T, "fan speed rpm": speed * 30.0 / np.pi, "torque_Nm": torque}

    _, system, text = drafted_days(tmp_path, day)
    assert values(system)["J"] == pytest.approx(0.4, rel=0.05)
    assert "shaft: {effort: tau, unit: N m, velocity: w}" in text


def test_a_wall_that_nothing_heats_exchanges_with_what_is_heated(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        power, gas, wall = drive(k, 0.0, 400.0), np.full(N, 20.0), np.full(N, 20.0)
        for n in range(1, N):
            between = 6.0 * (gas[n - 1] - wall[n - 1])
            gas[n] = gas[n - 1] + (power[n - 1] - between - 1.0 * (gas[n - 1] - 20.0)) / 150.0
            wall[n] = wall[n - 1] + (between - 2.0 * (wall[n - 1] - 20.0)) / 700.0
        columns = {"T_gas_degC": gas, "T_wall_degC": wall, "T_amb_degC": 20.0 + 1e-4 * np.arange(N)}
        return {"t_s": T, **columns, "P_burner_W": power}

    mapping, system, text = drafted_days(tmp_path, day)
    assert mapping["signals"]["P1"]["column"] == "P_burner_W" and "P2" not in mapping["signals"]
    assert "T2: (g2*(T1 - T2) - k2*(T2 - T_a) - x2)/C2" in text
    found = values(system)
    assert [found[name] for name in ("C1", "C2", "g2")] == pytest.approx([150.0, 700.0, 6.0], rel=0.05)


def test_a_cylinder_is_driven_by_both_of_its_chambers(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        near, far = drive(k, 20.0, 60.0), drive(k + 10, 20.0, 60.0)
        v = filled(100.0 * near - 60.0 * far - 1500.0, 30.0, 900.0, 0.0, 0.0, 0.01)
        return {"time_s": 0.01 * T, "ram [mm]": 10.0 * np.cumsum(v), "p1 [bar]": near, "p2 [bar]": far}

    _, system, text = drafted_days(tmp_path, day, largest=np.inf)
    assert "w: (k*u - k_2*u_2 - b*w - tau)/J" in text
    assert values(system)["k_2"] / values(system)["k"] == pytest.approx(0.6, rel=0.1)
    assert values(system)["J"] / values(system)["k"] == pytest.approx(30.0 / 1e-3, rel=0.2)


def test_a_set_point_of_a_level_is_no_level(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        power = drive(k, 0.0, 50.0)
        columns = {"temp_set_degC": drive(k, 20.0, 40.0), "power_W": power}
        return {"t": T, **columns, "temp_degC": filled(power, 120.0, 0.8, 20.0, 20.0)}

    mapping, _, text = drafted_days(tmp_path, day, 2, np.inf)
    assert mapping["signals"]["T"]["column"] == "temp_degC" and len(mapping["signals"]) == 2
    assert "# temp_set_degC is the set point of T: the loop is closed" in text


def test_a_pack_with_its_temperature_is_electric(tmp_path: Path) -> None:
    def day(k: int) -> Mapping[str, Array]:
        current = drive(k, -2.0, 2.0)
        voltage = filled(current, 300.0, 0.0, 20.0) + 0.03 * current
        beside = {"coolant_temp": 30.0 + 1e-3 * np.arange(N), "soc": 50.0 + voltage}
        return {"t_s": T, "stack_voltage": voltage, "stack_current": current, **beside}

    mapping, _, _ = drafted_days(tmp_path, day, 2, np.inf)
    assert columns_of(mapping) == {"U": "stack_voltage", "i": "stack_current"}


def test_a_run_that_was_broken_off_is_left_out(tmp_path: Path) -> None:
    table = pd.DataFrame({**LOGS[0], "rep": np.append(np.repeat([1, 2, 3, 4], 370), np.full(20, 5))})
    table.to_csv(tmp_path / "all.csv", index=False)
    mapping, system = drafted(tmp_path)
    logs = read_logs(tmp_path, system)
    assert mapping["split_by"] == "rep" and logs.ids == ("1", "2", "3", "4")
    assert any("runs of 'rep' with fewer than 50 samples, left out: 1" in note for note in logs.notes)


@pytest.mark.parametrize(
    ("name", "numbers"),
    [("piece", [0, 1, 2]), ("episode_index", [0, 1, 2]), ("Versuch", [4, 9, 11]), ("lap", [1, 2, 3])],
)
def test_a_column_that_numbers_parts_cuts_a_record(tmp_path: Path, name: str, numbers: list[int]) -> None:
    """A name that says nothing counts where its values go on one by one from 0 or 1."""
    whole = {key: np.concatenate([log[key] for log in LOGS]) for key in ("angle", "torque")}
    whole |= {"t": np.arange(4500) * 0.004, name: np.repeat(numbers, 1500)}
    pd.DataFrame(whole).to_csv(tmp_path / "all.csv", index=False)
    mapping, system = drafted(tmp_path)
    assert mapping["split_by"] == name and "cut" not in mapping
    assert read_logs(tmp_path, system).ids == tuple(map(str, numbers))
