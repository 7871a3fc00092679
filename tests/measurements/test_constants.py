"""Constants that the system file gives, and inputs that are logged early or late; from folders and stores."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.machines.folders import logs_of, system_of, text_of
from tests.machines.known import written_again
from tests.measurements.systems import assert_same, motor, rows, run, write_folder
from unmodelled import BadInput, read_logs
from unmodelled.systems.model import Constant, State, System

WEAR = Constant("wear", "1", {"a": 0.25, "b": -0.5, "elsewhere": 9.0})


def given(*constants: Constant, system: System | None = None) -> System:
    return replace(system or motor(), operating_point=constants)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_folder(tmp_path / "logs", {"a": run(), "b": run(100)})


def test_values_of_the_file_need_no_column_and_take_the_place_of_one(folder: Path) -> None:
    logs = read_logs(folder, given(WEAR, Constant("m", "kg")))
    assert logs.constants == ("wear", "m")
    assert logs.c.tolist() == [[0.25, 0.5], [-0.5, 0.5]]
    assert logs.experiments["wear"].tolist() == [0.25, -0.5]
    assert not any("wear" in note for note in logs.notes)
    write_folder(folder, {"a": run(), "b": run(100)}, wear=["new", "old"])
    logs = read_logs(folder, given(WEAR))
    assert logs.c.tolist() == [[0.25], [-0.5]]


def test_a_constant_may_have_the_unit_of_its_column(tmp_path: Path) -> None:
    system = system_of(text_of("walled_room.yaml"), tmp_path)
    log = {"t": np.arange(60) * 10.0, "P": np.sin(np.arange(60)), "T": 20.0 + np.cos(np.arange(60))}
    logs = logs_of(system, tmp_path / "logs", [log, log], id=["a", "b"], T_out=[5.0, -3.0])
    np.testing.assert_allclose(logs.c, [[278.15, 283.15], [270.15, 293.15]])
    logs.to_hdf5(tmp_path / "logs.h5", system)
    np.testing.assert_allclose(read_logs(tmp_path / "logs.h5", system).c, logs.c)
    again = written_again(system, tmp_path)
    np.testing.assert_allclose(read_logs(tmp_path / "logs", again).c, logs.c)


def test_an_experiment_that_the_file_does_not_name_has_the_other_value(folder: Path) -> None:
    logs = read_logs(folder, given(Constant("wear", "1", {"b": 1.0}, 0.0), Constant("m", "kg")))
    assert logs.c.tolist() == [[0.0, 0.5], [1.0, 0.5]]
    (note,) = [note for note in logs.notes if "wear" in note]
    assert "1 of 2 experiments, a among them" in note


def test_without_another_value_it_is_refused(folder: Path) -> None:
    unknown = given(Constant("wear", "1", {"a": 1.0, "B": 2.0}))
    with pytest.raises(BadInput, match=r"experiments.csv: row 3: column id: the experiment 'b' is not in"):
        read_logs(folder, unknown)
    read_logs(folder, motor()).write(folder.parent / "store")
    both = given(*motor().operating_point, *unknown.operating_point)
    with pytest.raises(BadInput, match=r"store: experiments.parquet: row 2: column id: the experiment 'b'"):
        read_logs(folder.parent / "store", both)


@pytest.mark.parametrize("delay", [0.0113, -0.004, -0.00031])
def test_a_store_is_read_for_other_states_delays_and_constants(folder: Path, delay: float) -> None:
    read_logs(folder, motor()).write(folder.parent / "store")
    late = motor(input_delay=delay, inductance=0.5)
    states, dynamics = (*late.states, State("z", "A")), (*late.dynamics, late.x[2] - late.x[1] * 0.1)
    grown = given(*late.operating_point, WEAR, system=replace(late, states=states, dynamics=dynamics))
    assert_same(read_logs(folder.parent / "store", grown), read_logs(folder, grown), "notes")


@pytest.mark.parametrize(
    ("provenance", "words"),
    [
        ("[]", "provenance.json: must be an object, got a list"),
        ('{"logs": 1}', "logs: must be an object, got 1"),
        (None, "provenance.json: no such file"),
        # a column of its table is missing
        ("", "damaged store .experiments.parquet has no column samples"),
    ],
)
def test_a_damaged_store_is_refused(folder: Path, provenance: str | None, words: str) -> None:
    store = folder.parent / "store"
    read_logs(folder, motor()).write(store)
    if provenance is None:
        (store / "provenance.json").unlink()
    elif provenance:
        (store / "provenance.json").write_text(provenance)
    else:
        table = pd.read_parquet(store / "experiments.parquet")
        table.drop(columns="samples").to_parquet(store / "experiments.parquet")
    with pytest.raises(BadInput, match=words):
        read_logs(store, motor())


@pytest.mark.parametrize("delay", [0.2, -5.0])
def test_a_delay_as_long_as_an_experiment_is_refused(folder: Path, delay: float) -> None:
    with pytest.raises(BadInput, match=r"inputs.V.delay: .* is too long for experiment b of 0.198 s"):
        read_logs(folder, motor(input_delay=delay))


def test_a_part_of_a_log_has_the_constants_of_the_log(tmp_path: Path) -> None:
    values = {"a": 0.3, "b": 0.4, "b.part2": 0.5}
    known = replace(motor(), operating_point=(Constant("m", "kg", values),))
    kept = np.r_[0:200, 300:500]
    records = {name: rows(run(500), kept) for name in "ab"}
    logs = read_logs(write_folder(tmp_path, records), known)
    assert logs.ids == ("a.part1", "a.part2", "b.part1", "b.part2")
    assert logs.c[:, 0].tolist() == [0.3, 0.3, 0.4, 0.5]
    assert not any("are not in the system file" in note for note in logs.notes)
