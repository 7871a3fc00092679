"""States that no output shows go on where a record is cut, as they do in the machine."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import system_of, text_of, write_runs
from tests.machines.known import Array
from tests.measurements.systems import write
from unmodelled import Logs, diagnose, read_logs
from unmodelled.diagnosis.data.recording import Recording
from unmodelled.diagnosis.fitting.free_runs import free_runs
from unmodelled.diagnosis.fitting.simulation import Simulation
from unmodelled.logs.preparation import prepare, several
from unmodelled.systems.model import Port, System, symbol

PERIOD, SAMPLES, PARTS = 2.0, 1800, 6


@dataclass(frozen=True)
class Machine:
    """A machine with a store that no output shows, and its own equations."""

    text: str
    rates: Callable[[Array, float], list[float]]
    start: tuple[float, ...]
    shows: Callable[[Array, Array], Array]
    levels: tuple[float, ...]  # of the input, in turn
    noise: float
    horizon: float


PLATE = Machine(
    text_of("plate.yaml"),
    lambda x, u: [(u - 2.0 * (x[0] - x[1])) / 40.0, (2.0 * (x[0] - x[1]) - 0.8 * (x[1] - 293.0)) / 900.0],
    (293.0, 293.0),
    lambda x, u: x[:, 0],
    (60.0, 20.0, 90.0, 5.0),
    0.05,
    200.0,
)
TANKS = Machine(
    text_of("tanks.yaml"),
    lambda x, u: [
        (u - 3e-4 * np.sqrt(19.62 * x[0])) / 0.1,
        (3e-4 * np.sqrt(19.62 * x[0]) - 4e-4 * np.sqrt(19.62 * x[1])) / 0.02,
    ],
    (0.5, 0.2),
    lambda x, u: x[:, 1],
    (1.2e-3, 0.7e-3, 1.6e-3, 0.9e-3),
    0.001,
    100.0,
)
CELL = Machine(
    text_of("branched_cell.yaml"),
    lambda x, u: [-u / 7200.0, (0.05 * u - x[1]) / 700.0],
    (0.9, 0.0),
    lambda x, u: 3.3 + 0.8 * x[:, 0] - 0.03 * u - x[:, 1],
    (4.0, -1.5, 2.0, 0.0, -2.0),
    0.0005,
    300.0,
)
MACHINES = {"plate": PLATE, "tanks": TANKS, "cell": CELL}


def signals(machine: Machine) -> tuple[Array, Array, Array]:
    """Time, held input and measured output of one record, integrated in small steps."""
    u = np.resize(np.repeat(machine.levels, 110), SAMPLES)
    x, states, h = np.array(machine.start), [], PERIOD / 20.0
    for held in u:
        states.append(x)
        for _ in range(20):
            middle = x + 0.5 * h * np.array(machine.rates(x, held))
            x = x + h * np.array(machine.rates(middle, held))
    noise = machine.noise * np.random.default_rng(3).standard_normal(SAMPLES)
    return PERIOD * np.arange(SAMPLES), u, machine.shows(np.array(states), u) + noise


def read(folder: Path, machine: Machine, lost: slice = slice(0, 0), **mapping: str) -> tuple[System, Logs]:
    """The machine, and its record by a mapping."""
    system, columns = system_of(machine.text, folder), dict(zip("tuy", signals(machine), strict=True))
    record = {name: np.delete(column, lost) for name, column in columns.items()}
    used = {"u": system.inputs[0], "y": system.outputs[0]}
    named = {item.column: {"column": column, "unit": item.unit} for column, item in used.items()}
    keys = {"files": ["record.csv"], "time": {"column": "t", "unit": "s"}, "constants": None, **mapping}
    write(folder, {"record": record}, signals=named, **keys)
    return system, read_logs(folder, system)


@pytest.mark.parametrize("name", MACHINES)
def test_a_cut_record_has_the_gap_of_the_whole_one(name: str, tmp_path: Path) -> None:
    """Also of some of its parts: the states go on through those that are not simulated."""
    machine = MACHINES[name]
    system, whole = read(tmp_path, machine)
    cut = read(tmp_path, machine, cut=f"{PERIOD * SAMPLES / PARTS:g} s")[1]
    assert (len(whole), len(cut)) == (1, PARTS)
    known = free_runs(system, whole, machine.horizon)
    assert known.value < 1.5 * known.floor
    for logs, runs in ((cut, None), (cut, [2, 5]), (several(system, whole), None)):
        found = free_runs(system, logs, machine.horizon, runs)
        assert found.value < 1.5 * found.floor
    anew = prepare(system, replace(cut, continues=()))
    assert free_runs(system, anew, machine.horizon).value > 3.0 * known.value


@pytest.mark.long
def test_a_complete_model_of_a_cut_record_has_no_gap(tmp_path: Path) -> None:
    """Where its core started anew in every part, a conductance of the plate drifted from part to part."""
    system, logs = read(tmp_path, PLATE, cut="600 s")
    conductance = replace(system.parameters[3], identify=True, bounds=(0.1, 3.0))
    surface = Port("wall", "q", "W", position="surface")
    rates = (system.dynamics[0] - symbol("q") / symbol("C"), system.dynamics[1])
    free = replace(
        system,
        parameters=(*system.parameters[:3], conductance, *system.parameters[4:]),
        ports=(surface,),
        dynamics=rates,
    )
    assert diagnose(free, logs).verdict == "no_gap"


def test_hidden_states_go_on_over_a_gap(tmp_path: Path) -> None:
    """The store of a plate is integrated over lost samples, with its input held straight between them."""
    system, logs = read(tmp_path, PLATE, lost=slice(900, 930))
    assert [logs.gap(i) for i in range(len(logs))] == [None, 31]
    found = free_runs(system, logs, PLATE.horizon)
    assert found.value < 3.0 * found.floor
    anew = prepare(system, replace(logs, continues=()))
    assert free_runs(system, anew, PLATE.horizon).value > 10.0 * found.value


def test_spans_of_one_log_continue_each_other(tmp_path: Path) -> None:
    """Next to each other they do; over a rest that is as long as they are, states start anew."""
    system, whole = read(tmp_path, TANKS)
    t, u, y = signals(TANKS)
    folder = write_runs(tmp_path / "spans", [pd.DataFrame({"t": t, "inflow": u, "y": y})])
    table = "id,file,t_from,t_to\na,run0.csv,,1200\nb,run0.csv,1200,1800\nc,run0.csv,3000,\n"
    (folder / "experiments.csv").write_text(table)
    logs = read_logs(folder, system)
    assert [logs.gap(i) for i in range(3)] == [None, 1, None]
    np.testing.assert_allclose(logs.x[logs.rows(1)], whole.x[600:900], atol=2e-3)


def test_a_part_alone_starts_where_the_record_was(tmp_path: Path) -> None:
    system, logs = read(tmp_path, PLATE, cut="600 s")
    alone = prepare(system, logs.among([4]))
    np.testing.assert_allclose(alone.x[0], logs.x[logs.offsets[4]])
    assert alone.gap(0) is None


def test_a_store_keeps_what_continues(tmp_path: Path) -> None:
    system, logs = read(tmp_path, PLATE, cut="600 s")
    logs.write(tmp_path / "store")
    stored = prepare(system, Logs.read(tmp_path / "store", system))
    assert stored.continues == logs.continues
    np.testing.assert_array_equal(stored.x, logs.x)


def test_numbers_of_single_parts_change_along_a_record(tmp_path: Path) -> None:
    """A parameter of its own in every part: the states of a part go on from the end of the part before."""
    system, logs = read(tmp_path, PLATE, cut="600 s")

    def hidden_starts() -> Array:
        return Simulation(system, Recording.whole(logs)).hidden_starts(values)

    values = np.tile(system.values, (len(logs), 1, 1))
    hidden = hidden_starts()
    values[2, 0, 1] *= 1.0 + 1e-12
    np.testing.assert_allclose(hidden_starts(), hidden)
    values[2, 0, 1] *= 0.5
    changed = hidden_starts()
    assert np.abs(changed - hidden)[:3].max() < 1e-9 < 1e-2 < np.abs(changed - hidden)[3]
