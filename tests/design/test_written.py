"""A written experiment is read back and simulated: nothing that could hurt a machine is kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import Array, changed, system_of, text_of
from unmodelled.api.plan import plan
from unmodelled.base.errors import BadInput
from unmodelled.design import written
from unmodelled.design.allowed import Watched
from unmodelled.design.content import conditions
from unmodelled.design.limits import Limits, read_limits
from unmodelled.design.runs import start_of
from unmodelled.design.written import ends_notes, frame, rest_notes, write_experiment
from unmodelled.systems.model import System

ROOM = """
duration: 400
period: 4
inputs: {P: {low: 0, high: 3, rate: 0.5}, T_out: {low: 18, high: 22, rate: 0.1}, valve: {low: -90, high: 90}}
travel: {T: {low: 15, high: 40, speed: 0.2}}
start: {T: 20}
noise: {T: 0.02}
"""


@pytest.fixture
def room(tmp_path: Path) -> tuple[System, Limits]:
    system = system_of(text_of("heated_room.yaml"), tmp_path)
    (tmp_path / "limits.yaml").write_text(ROOM)
    return system, read_limits(tmp_path / "limits.yaml", system)


def usual(limits: Limits) -> Array:
    """An experiment (samples, inputs), SI, within the limits: 0 to 1 kW, 18 to 20 degC, 0 to 50 %."""
    rise = np.minimum(np.arange(limits.samples), np.arange(limits.samples)[::-1])
    return np.stack([np.minimum(100.0 * rise, 1000.0), 291.15 + np.minimum(0.2 * rise, 2.0)], axis=1)[
        :, [0, 1, 1]
    ] * [1.0, 1.0, 0.0] + np.outer(np.minimum(rise, 5) / 10.0, [0.0, 0.0, 1.0])


def scaled(column: str, factor: float, shift: float = 0.0) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda table: table.assign(**{column: table[column] * factor + shift})


def at(column: str, row: int, value: float) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def change(table: pd.DataFrame) -> pd.DataFrame:
        table.loc[row, column] = value
        return table

    return change


def swapped(table: pd.DataFrame) -> pd.DataFrame:
    return table.rename(columns={"P": "valve", "valve": "P"})


def renumbered(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(t=4.0 * np.arange(len(table)))


MUTATIONS: dict[str, Callable[[pd.DataFrame], pd.DataFrame]] = {
    "in W": scaled("P", 1000.0),
    "in MW": scaled("P", 1e-3),
    "in K": scaled("T_out", 1.0, 273.15),
    "as a share": scaled("valve", 0.01),
    "with the other sign": scaled("valve", -1.0),
    "half as much": scaled("P", 0.5),
    "twice as much": scaled("P", 2.0),
    "one percent more": scaled("P", 1.01),
    "an offset": scaled("P", 1.0, 0.1),
    "columns swapped": swapped,
    "a spike": at("P", 50, 2.9),
    "a spike beyond": at("valve", 50, 95.0),
    "not a number": at("P", 50, np.nan),
    "infinite": at("P", 50, np.inf),
    "begins elsewhere": at("P", 0, 0.3),
    "does not come back": at("P", 100, 1.0),
    "without its end": lambda table: table.iloc[:60],
    "without a row": lambda table: renumbered(table.drop(index=30)),
    "a row twice": lambda table: renumbered(pd.concat([table.iloc[:31], table.iloc[30:]])),
    "rows mixed": lambda table: renumbered(table.sample(frac=1.0, random_state=0)),
    "later": lambda table: renumbered(table.shift(3).bfill()),
    "a column less": lambda table: table.drop(columns="valve"),
    "time 1.5 times too long": scaled("t", 1.5),
    "time in ms": scaled("t", 1000.0),
    "time in minutes": scaled("t", 1.0 / 60.0),
    "time in samples": scaled("t", 0.25),
    "time from 5 s on": scaled("t", 1.0, 5.0),
    "time backwards": lambda table: table.assign(t=table["t"].to_numpy()[::-1]),
    "one time late": at("t", 50, 203.0),
    "a pause": lambda table: table.assign(t=table["t"] + 8.0 * (table["t"] > 200.0)),
    "slower and slower": lambda table: table.assign(t=table["t"] ** 1.01),
}


@pytest.mark.parametrize("name", MUTATIONS)
def test_a_file_with_another_experiment_is_not_kept(
    room: tuple[System, Limits], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    system, limits = room
    u, file = usual(limits), tmp_path / "experiment.csv"
    write_experiment(u, system, limits, file, Watched(system, limits))
    assert len(pd.read_csv(file)) == limits.samples
    file.unlink()
    monkeypatch.setattr(written, "frame", lambda *given: MUTATIONS[name](frame(*given)))
    with pytest.raises(BadInput) as error:
        write_experiment(u, system, limits, file, Watched(system, limits))
    assert "\n" not in str(error.value) and not file.exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("high: 40", "high: 21", "T reaches .* degC, beyond its travel 15 to 21 degC"),
        ("low: 15", "low: 19.9", "T reaches .* degC, beyond its travel 19.9 to 40 degC"),
        ("speed: 0.2", "speed: 0.001", "T moves at .* degC/s, faster than its speed 0.001 degC/s"),
    ],
)
def test_a_file_that_moves_a_machine_too_far_is_not_kept(
    room: tuple[System, Limits], tmp_path: Path, old: str, new: str, message: str
) -> None:
    system, limits = room
    u = usual(limits)
    if old.startswith("low"):
        u[:] = [0.0, 291.15, 0.0]
    (tmp_path / "limits.yaml").write_text(changed(ROOM, (old, new)))
    limits = read_limits(tmp_path / "limits.yaml", system)
    with pytest.raises(BadInput, match=message):
        write_experiment(u, system, limits, tmp_path / "experiment.csv", Watched(system, limits))
    assert not (tmp_path / "experiment.csv").exists()


def test_an_experiment_that_does_not_end_at_rest_is_not_kept(
    room: tuple[System, Limits], tmp_path: Path
) -> None:
    system, limits = room
    u, file = usual(limits), tmp_path / "experiment.csv"
    u[-10:, 0] = u[-11, 0]
    with pytest.raises(BadInput, match="column P ends at 1 kW, not at rest"):
        write_experiment(u, system, limits, file, Watched(system, limits))
    write_experiment(u, system, limits, file, Watched(system, limits), at_rest=False)
    (note,) = ends_notes([("mine", pd.read_csv(file))], system, limits)
    assert note.startswith("mine: P begins at 0 kW and ends at 1 kW, not at 0 kW")
    (note,) = rest_notes(system, limits)
    assert note.startswith("T_out begins and ends at 18 degC, because its limits exclude zero")
    assert "at most 0.1 degC/s" in note


CART = """
duration: 4
period: 0.02
inputs: {force: {low: -2, high: 2, rate: 20}}
travel: {x: {low: -40, high: 40}}
start: {x: 10}
noise: {x: 0.1, v: 0.001}
"""


#: Factor (cm/m) and offset (cm) of columns by what a system file says of them.
READ = {
    "{unit: cm, expression: 2*x}": (200.0, 0.0),
    "{unit: cm, expression: x + x_0}": (100.0, 25.0),
    "{unit: cm, expression: 2*x_0 - x}": (-100.0, 50.0),
    "{unit: cm, expression: -x}": (-100.0, 0.0),
    "{unit: cm}": (100.0, 0.0),
}


@pytest.mark.parametrize("column", READ)
def test_travel_and_start_are_those_of_the_column(tmp_path: Path, column: str) -> None:
    slope, shift = READ[column]
    state = (10.0 - shift) / slope
    text = changed(
        text_of("cart.yaml"),
        ("outputs: {x: {unit: m}", f"outputs: {{x: {column}"),
        ("parameters: {", "parameters: {x_0: {value: 0.25, unit: m}, "),
    )
    system = system_of(text, tmp_path)
    (tmp_path / "limits.yaml").write_text(CART)
    limits = read_limits(tmp_path / "limits.yaml", system)
    rest = np.zeros(1)
    assert start_of(system, limits, limits.c, rest) == pytest.approx([state, 0.0])
    assert conditions(system, limits, rest)["start"]["x"] == {"value": pytest.approx(10.0), "unit": "cm"}
    found = plan(system, tmp_path / "limits.yaml")
    tables = found.experiments().values()
    reached = [slope * np.array(moved(table["force"].to_numpy(), state)) + shift for table in tables]
    assert np.min(reached) >= -40.0
    assert np.max(reached) <= 40.0
    assert np.ptp(reached) > 10.0


def moved(force: Array, start: float) -> list[float]:
    """Positions (m) of the cart, whose force runs straight between samples."""
    x, v, found, h = start, 0.0, [], 0.02 / 50
    for before, after in zip(force, [*force[1:], force[-1]], strict=True):
        found.append(x)
        for k in range(50):
            x, v = x + h * v, v + h * (before + k / 50 * (after - before) - 0.5 * v) / 2.0
    return found


def test_a_start_that_does_not_follow_from_a_column_is_one_line(tmp_path: Path) -> None:
    text = changed(
        text_of("cart.yaml"),
        ("outputs: {x: {unit: m}", "outputs: {x: {unit: m, expression: x*abs(x)/x_0}"),
        ("parameters: {", "parameters: {x_0: {value: 0.25, unit: m}, "),
    )
    system = system_of(text, tmp_path)
    (tmp_path / "limits.yaml").write_text(CART.replace("start: {x: 10}", "start: {x: 0.1}"))
    with pytest.raises(BadInput, match="the start of the state x does not follow") as error:
        read_limits(tmp_path / "limits.yaml", system)
    assert str(tmp_path / "limits.yaml") in str(error.value)
