"""Planted laws of stores of heat, fluid, charge and flux: named, with their numbers."""

from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled
from tests.machines.folders import Array, diagnosed, motion, only_effect, recorded, text_of, values_of

pytestmark = pytest.mark.long
Random = np.random.Generator

HOUSE, TANK, BATTERY = text_of("house.yaml"), text_of("tank.yaml"), text_of("battery.yaml")
CELL, COIL, WINDING = text_of("charged_cell.yaml"), text_of("iron_coil.yaml"), text_of("winding.yaml")
#: The store is in the file; the temperature at which it starts is not known.
WALLED = text_of("walled_house.yaml")
RUNS, SAMPLES = 8, 300
#: K, by which walls start below the air of every run.
BELOW = (1.0, -4.0, 3.0, 0.0, -2.0, 5.0, 2.0, -1.0)


def logs(
    folder: Path, names: tuple[str, str], period: float, levels: list[float], start: tuple[float, float],
    rate: Callable[..., list[float]], noise: float, stores: int = 0, series: float = 0.0,
    below: Sequence[float] = (0.0,) * RUNS, ambient: str = "",
) -> Path:  # fmt: skip
    """A folder of runs with steps of the input, which is held between samples.

    The states of `rate` are the level and `stores` others, which start `below` it in every run; `series`
    times the input is taken from what is logged. Where `ambient` is the name of a column, `rate` also gets
    this temperature, which rises and falls, and all inputs run straight between samples.
    """
    numbers = count()

    def run(rng: Random) -> pd.DataFrame:
        k, u = next(numbers), np.repeat(rng.choice(levels, SAMPLES // 30), 30)
        x = rng.uniform(*start) - below[k] * (np.arange(1 + stores) > 0)
        around = rng.uniform(274.0, 280.0) + 5.0 * np.sin(0.03 * np.arange(SAMPLES) + k)
        inputs = {names[0]: u} | ({ambient: around} if ambient else {})
        u_of_t = np.column_stack([*inputs.values()])
        path = motion(lambda x, u: rate(*x, *u), x, u_of_t, period, held=not ambient)
        seen = path[:, 0] - series * u + noise * rng.standard_normal(SAMPLES)
        return pd.DataFrame({"t": period * np.arange(SAMPLES), **inputs, names[1]: seen})

    return recorded(folder, run, RUNS)


def house(folder: Path, rate: Callable[..., list[float]], **more: object) -> Path:
    """Logs of a house with a heater, of which only the temperature is measured."""
    heat = [0.0, 1500.0, 3000.0, 4500.0]
    return logs(folder / "logs", ("P", "T"), 120.0, heat, (285.0, 297.0), rate, 0.02, **more)  # type: ignore[arg-type]


def with_walls(T: float, wall: float, P: float) -> list[float]:
    return [(P - 400.0 * (T - wall) - 60.0 * (T - 278.0)) / 8.0e5, 400.0 * (T - wall) / 6.0e6]


def test_the_heat_that_a_house_loses_to_its_surroundings(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, HOUSE, house(tmp_path, lambda T, P: [(P - 120.0 * (T - 278.0)) / 2.0e6]))
    effect = only_effect(answer, "linear_loss", "air")
    assert effect.parameters["k"]["value"] == pytest.approx(120.0, rel=0.02)
    assert effect.parameters["k"]["unit"] == "W/K"
    assert effect.parameters["x_a"]["value"] == pytest.approx(278.0, abs=0.3)


def test_the_heat_that_a_house_loses_to_a_logged_temperature(tmp_path: Path) -> None:
    outdoors = text_of("house.yaml", ("P: {unit: W}", "P: {unit: W}\n  T_out: {unit: K, commanded: false}"))
    rate = lambda T, P, T_out: [(P - 120.0 * (T - T_out)) / 2.0e6]  # noqa: E731
    effect = only_effect(
        diagnosed(tmp_path, outdoors, house(tmp_path, rate, ambient="T_out")), "linear_loss", "air"
    )
    assert effect.law == "k*(T - T_out)"
    assert effect.parameters["k"]["value"] == pytest.approx(120.0, rel=0.02)


def test_a_loss_that_grows_with_a_fan_of_which_the_equations_know_nothing(tmp_path: Path) -> None:
    """The column has the name and the numbers of a fan's speed, 1/min."""
    cooled = text_of(
        "house.yaml",
        ("P: {unit: W}", "P: {unit: W}\n  fan: {unit: 1/min, commanded: false}"),
        ("(P - q)/C", "(P - G*(T - 280) - q)/C"),
        ("ports:", "  G: {value: 90, unit: W/K, identify: true, bounds: [10, 500]}\nports:"),
    )
    rate = lambda T, P, fan: [(P - (80.0 + 5.0 * (fan - 270.0)) * (T - 280.0)) / 2.0e6]  # noqa: E731
    effect = only_effect(
        diagnosed(tmp_path, cooled, house(tmp_path, rate, ambient="fan")), "input_dependence", "air"
    )
    assert values_of(effect) == pytest.approx([5.0 * 60.0], rel=0.02)  # per 1/s
    assert effect.law.startswith("G + G_per_fan*(fan - ")


def test_the_overflow_of_a_tank(tmp_path: Path) -> None:
    recorded = logs(
        *(tmp_path / "logs", ("q_in", "h"), 1.0, [0.0, 0.01, 0.02, 0.03, 0.05], (0.3, 1.0)),
        lambda h, q: [(q - 0.02 * max(h, 0.0) ** 0.5 - 0.3 * max(h - 1.2, 0.0) ** 1.5) / 0.5],
        0.001,
    )
    answer = diagnosed(tmp_path, TANK, recorded)
    assert answer.verdict in ("effect", "main_effect")
    assert (answer.effects[0].family, answer.effects[0].port) == ("overflow", "vessel")
    assert answer.effects[0].parameters["x_o"]["value"] == pytest.approx(1.2, abs=0.06)
    assert answer.effects[0].shrink > 0.9


def test_a_house_with_walls_that_store_heat(tmp_path: Path) -> None:
    """Two effects at one port: what leaves the house, and what its walls take and return."""
    answer = diagnosed(tmp_path, HOUSE, house(tmp_path, with_walls, stores=1))
    found = {effect.family: values_of(effect) for effect in answer.effects}
    assert found["storage"] == pytest.approx([400.0, 6.0e6 / 400.0], rel=0.1)
    # over few degrees, radiation is a loss in proportion
    (loss,) = (effect for effect in answer.effects if effect.family != "storage")
    assert loss.family in ("linear_loss", "radiation")
    assert loss.parameters["x_a"]["value"] == pytest.approx(278.0, rel=0.1)


def test_walls_that_start_every_experiment_at_a_temperature_of_their_own(tmp_path: Path) -> None:
    """The start of a state that nothing measures is fitted in every experiment, and is no finding."""
    recorded = house(tmp_path, with_walls, stores=1, below=BELOW)
    answer = diagnosed(tmp_path, WALLED, recorded)
    effect = only_effect(answer, "linear_loss", "air")
    assert effect.parameters["k"]["value"] == pytest.approx(60.0, rel=0.1)
    (start,) = (c for c in answer.system.operating_point if c.name == "T_w_0")
    first = {run: float(pd.read_csv(recorded / f"{run}.csv")["T"].iloc[0]) for run in start.values}
    found = [first[run] - value for run, value in start.values.items()]
    assert found == pytest.approx(BELOW, abs=0.3)
    assert list(answer.parameters["name"]) == ["C"]
    again = unmodelled.simulate(answer.system, unmodelled.read_logs(recorded, answer.system))
    assert again.value < 0.02


def test_the_slow_charge_of_a_battery(tmp_path: Path) -> None:
    """The voltage at the terminals shows the charge beside the drop at a resistance that is fitted.

    A second capacitor behind a conductance is at the terminals what an RC branch in series is.
    """
    recorded = logs(
        *(tmp_path / "logs", ("i", "U"), 1.0, [-10.0, 0.0, 0.0, 5.0, 10.0, 20.0], (3.5, 3.7)),
        lambda v, slow, i: [(-i - 60.0 * (v - slow)) / 3.0e3, 60.0 * (v - slow) / 6.0e3],
        *(0.0005, 1, 0.015),
    )
    answer = diagnosed(tmp_path, BATTERY, recorded)
    effect = only_effect(answer, "storage", "cell")
    assert effect.indistinguishable == ("rc branch at sensor U",)
    assert effect.parameters["k"]["value"] == pytest.approx(60.0, rel=0.02)
    assert effect.parameters["tau_n"]["value"] == pytest.approx(100.0, rel=0.03)
    assert answer.parameters["identified"].to_list() == pytest.approx([3000.0, 0.015], rel=0.02)


RESISTANCE, TIME = 0.02, 45.0  # ohm, s


def record(folder: Path, charges: Sequence[float] = (0.9,) * RUNS) -> Path:
    """Pulses of current through a cell that are held between samples, from a charge each."""
    starts = iter(charges)

    def run(rng: Random) -> pd.DataFrame:
        i = np.repeat(rng.choice([0.0, 1.0, 2.0, 4.0, -1.5], 15), 60)
        rates = lambda x, i: [-i / 7200.0, (RESISTANCE * i - x[1]) / TIME]  # noqa: E731
        charge, branch = motion(rates, [next(starts), 0.0], i, 1.0, held=True).T
        v = 3.3 + 0.8 * charge - 0.025 * i - branch + 1e-3 * rng.standard_normal(len(i))
        return pd.DataFrame({"t": np.arange(len(i)) * 1.0, "i": i, "v": v})

    return recorded(folder, run, len(charges))


@pytest.mark.parametrize("lowest", [pytest.param(0.9, id="full"), pytest.param(0.4, id="at other charges")])
def test_the_slow_part_of_the_voltage_is_named(tmp_path: Path, lowest: float) -> None:
    """The system file has no ports, and says that the battery is full; it starts where its voltage says."""
    answer = diagnosed(tmp_path, CELL, record(tmp_path / "logs", np.linspace(lowest, 0.9, RUNS).tolist()))
    effect = only_effect(answer, "rc_branch", "sensor:v")
    assert effect.parameters["R_1"]["value"] == pytest.approx(-RESISTANCE, rel=0.05)
    assert effect.parameters["tau_1"]["value"] == pytest.approx(TIME, rel=0.05)
    assert effect.parameters["R_1"]["unit"] == "ohm"


def inductance(current: Array) -> Array:
    """Another form than that of the library: the slope of a hyperbolic tangent, and leakage."""
    return 0.002 + 0.008 / np.cosh(current / 2.5) ** 2


def test_the_core_of_a_coil_saturates(tmp_path: Path) -> None:
    """The current at which the saturation of a coil with an iron core sets in is found."""
    t = 2e-4 * np.arange(600)

    def run(rng: Random) -> pd.DataFrame:
        rate, phase = rng.uniform(40.0, 250.0, 3), rng.uniform(0.0, 6.28, 3)
        u = 3.0 * np.sin(rate * t[:, None] + phase).sum(1)
        i = motion(lambda i, u: (u - 1.0 * i) / inductance(i), [0.0], u, 2e-4)[:, 0]
        return pd.DataFrame({"t": t, "u": u, "i": i + 1e-3 * rng.standard_normal(len(t))})

    answer = diagnosed(tmp_path, COIL, recorded(tmp_path / "logs", run, RUNS))
    assert answer.verdict in ("effect", "main_effect")
    first = answer.effects[0]
    assert (first.family, first.port) == ("inductance_saturation", "winding")
    assert first.shrink > 0.9
    # half of what can vanish has vanished where the tangent's slope has fallen to a half
    assert first.parameters["i_s"]["value"] == pytest.approx(2.5 * np.arccosh(2.0**0.5), rel=0.25)
    assert first.parameters["i_s"]["unit"] == "A"


#: ohm, 1/K of copper, K/W and J/K: a time constant of 6 s.
COLD, COPPER, TO_AIR, HEAT = 2.0, 0.0039, 2.0, 3.0


def test_the_resistance_of_a_winding_grows_with_its_heat(tmp_path: Path) -> None:
    """The resistance that grows is named, with its time constant."""
    t = 0.02 * np.arange(600)

    def rates(x: Array, u: Array) -> Array:
        resistance = COLD * (1.0 + COPPER * x[1])
        return np.array([(u - resistance * x[0]) / 0.4, (resistance * x[0] ** 2 - x[1] / TO_AIR) / HEAT])

    def run(rng: Random) -> pd.DataFrame:
        rate, phase, mean = rng.uniform(0.5, 6.0, 2), rng.uniform(0.0, 6.28, 2), rng.uniform(-8.0, 8.0)
        u = mean + rng.uniform(2.0, 5.0) * np.sin(rate * t[:, None] + phase).sum(1)
        i = motion(rates, [0.0, 0.0], u, 0.02)[:, 0]
        return pd.DataFrame({"t": t, "u": u, "i": i + 2e-3 * rng.standard_normal(len(t))})

    answer = diagnosed(tmp_path, WINDING, recorded(tmp_path / "logs", run, 6))
    effect = answer.effects[0]
    assert answer.verdict in ("effect", "main_effect")
    assert (effect.family, effect.port) == ("self_heating", "terminal")
    assert effect.shrink > 0.9
    # the warmer winding takes more heat from the same current, which the law leaves out
    assert effect.parameters["tau_h"]["value"] == pytest.approx(TO_AIR * HEAT, rel=0.25)
    assert effect.parameters["k_h"]["value"] == pytest.approx(COLD**2 * COPPER * TO_AIR, rel=0.25)
    assert effect.parameters["k_h"]["unit"] == "ohm/A^2"
