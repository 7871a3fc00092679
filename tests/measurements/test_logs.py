"""Log folders become arrays on one uniform clock."""

from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.machines.folders import system_of, text_of
from tests.machines.known import written_again
from tests.measurements.systems import ANGLE, SPEED, assert_same, motor, refused, rows, run, write_folder
from unmodelled import BadInput, Logs, read_logs
from unmodelled.logs.preparation import prepare, several
from unmodelled.systems.model import Output

BOTH = [ANGLE, SPEED]


@settings(max_examples=20, deadline=None)
@given(n=st.integers(50, 200), hertz=st.sampled_from([50.0, 300.0, 1000.0, 7.0]), start=st.floats(0.0, 1e3))
def test_uniform_logs_come_back_unchanged(
    tmp_path_factory: pytest.TempPathFactory, n: int, hertz: float, start: float
) -> None:
    folder = tmp_path_factory.mktemp("uniform")
    log = run(n, 1.0 / hertz)
    shown = {**log, "t": np.round(start + log["t"], 6)}  # as printed
    logs = read_logs(write_folder(folder, {"a": shown, "b": shown}), motor(BOTH))
    for i in range(2):
        np.testing.assert_array_equal(logs.y[logs.rows(i)], np.stack([log["angle"], log["speed"]], 1))
        np.testing.assert_array_equal(logs.u[logs.rows(i), 0], log["voltage"])
        np.testing.assert_allclose(logs.t[logs.rows(i)], log["t"], atol=1e-6)
    assert logs.period == pytest.approx(1.0 / hertz, rel=1e-6)
    assert not any("clock" in note for note in logs.notes)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_formats_and_columns(tmp_path: Path, suffix: str) -> None:
    extra = {"operator": ["ann", "bob"], "shift": [1, 2], "exp": [7, 8], "group": ["g", ""]}
    folder = write_folder(tmp_path / "logs", {"a": run(), "b": run(300)}, suffix, **extra)
    logs = read_logs(folder, motor(BOTH))
    assert logs.ids == ("a", "b") and len(logs) == 2
    assert logs.offsets.tolist() == [0, 400, 700]
    assert logs.c.tolist() == [[0.5], [0.5]]
    assert logs.experiments["operator"].tolist() == ["ann", "bob"]
    assert logs.experiments["shift"].tolist() == [1.0, 2.0]
    assert logs.experiments["group"].tolist() == ["g", "b"]
    assert logs.provenance == {"data": "measured", "description": "log folder logs"}
    np.testing.assert_array_equal(logs.y[logs.rows(1), 1], run(300)["speed"])


def test_experiments_are_parts_of_one_log(tmp_path: Path) -> None:
    folder, log = write_folder(tmp_path, {"a": run()}), run()
    ends = ["p0,a.csv,0.5,,0.3", "p1,a.csv,0.5,0.3,0.5", "p2,a.csv,0.5,0.5,"]
    (folder / "experiments.csv").write_text("\n".join(["id,file,m,t_from,t_to", *ends]))
    logs = read_logs(folder, motor(BOTH))
    assert np.diff(logs.offsets).tolist() == [150, 100, 150] and "t_from" not in logs.experiments
    np.testing.assert_array_equal(logs.y[:, 0], log["angle"])
    np.testing.assert_allclose(logs.t[logs.rows(1)], 0.002 * np.arange(100), atol=1e-9)


@pytest.mark.parametrize(
    ("start", "end", "words"),
    [
        ("0.4", "0.3", "row 2: column t_to: must be after t_from = 0.4 s, got 0.3 s"),
        ("now", "", "row 2: column t_from"),
        ("5", "6", "row 2: column t_from: 'a.csv' has no sample with 5 s <= t < 6 s"),
        ("0.1", "0.15", "a.csv: row 76: column t: must have 50 samples or more, got 25"),
    ],
)
def test_parts_that_cannot_be(tmp_path: Path, start: str, end: str, words: str) -> None:
    folder = write_folder(tmp_path, {"a": run()}, t_from=[start], t_to=[end])
    told = refused(folder, motor(BOTH))
    assert words in told and "\n" not in told


def test_columns_in_other_units_are_converted(tmp_path: Path) -> None:
    known = system_of(text_of("oven.yaml"), tmp_path)
    assert [o.unit for o in known.outputs] == ["K", "rad", "rad/s"] and known.inputs[0].unit == "W"
    t, rng = 0.01 * np.arange(100), np.random.default_rng(0)
    seen = {"t": t, **{name: np.cumsum(rng.normal(size=100)) for name in ("power", "T", "phi", "n")}}
    logs = read_logs(write_folder(tmp_path / "logs", {"a": seen}), known)
    np.testing.assert_allclose(logs.u[:, 0], 1e3 * seen["power"])
    rpm = seen["n"] * 2.0 * np.pi / 60.0
    np.testing.assert_allclose(logs.y.T, [seen["T"] + 273.15, np.radians(seen["phi"]), rpm])
    frames = Logs.from_frames({"a": pd.DataFrame(seen)}, known)
    np.testing.assert_allclose(frames.y, logs.y)
    # what is written for a system file is read with it again
    logs.to_hdf5(tmp_path / "logs.h5", known)
    np.testing.assert_allclose(read_logs(tmp_path / "logs.h5", known).y, logs.y)
    again = written_again(known, tmp_path)
    assert (again.inputs, again.outputs) == (known.inputs, known.outputs)


def test_what_spreadsheets_write_is_read(tmp_path: Path) -> None:
    """A byte order mark, blanks, plus signs, quotes, blank lines, and an empty last column."""
    folder = write_folder(tmp_path, {"a": run()})
    rows = (folder / "a.csv").read_text().splitlines()
    rows = [", ".join(row.split(",")) + "," for row in rows]
    rows[3] = rows[3].replace(" ", "+", 1)
    rows[4] = '"' + rows[4].replace(",", '"', 1).replace('"', '",', 1).lstrip('"')
    (folder / "a.csv").write_bytes(b"\xef\xbb\xbf" + "\r\n".join([*rows, "", ""]).encode())
    np.testing.assert_array_equal(read_logs(folder, motor()).y[:, 0], run()["angle"])


def test_the_store_comes_back_exactly(tmp_path: Path) -> None:
    log = run()
    log["t"] = log["t"] + 1e-4 * np.random.default_rng(0).random(400)
    columns = {"exp": [3, 4], "samples": ["x", "y"], "group": ["g", "h"]}
    folder = write_folder(tmp_path / "logs", {"a": log, "b": run(100)}, **columns)
    (folder / "provenance.json").write_text('{"data": "virtual", "seed": 3}')
    logs = read_logs(folder, motor())
    logs.write(tmp_path / "store")
    again = read_logs(tmp_path / "store", motor())
    pd.testing.assert_frame_equal(again.experiments, logs.experiments)
    assert_same(again, logs)
    assert again.provenance == {"data": "virtual", "seed": 3}


def test_a_store_belongs_to_its_system(tmp_path: Path) -> None:
    read_logs(write_folder(tmp_path / "logs", {"a": run()}), motor()).write(tmp_path / "store")
    for other in (motor(BOTH), replace(motor(), operating_point=())):
        with pytest.raises(BadInput, match=r"store: provenance.json: was not written for the system motor"):
            read_logs(tmp_path / "store", other)


def test_the_states_of_another_system(tmp_path: Path) -> None:
    logs = read_logs(write_folder(tmp_path / "logs", {"a": run()}), motor())
    heavier = motor(inductance=0.5)
    again = prepare(heavier, logs)
    direct = read_logs(tmp_path / "logs", heavier)
    np.testing.assert_array_equal(again.x, direct.x)
    assert again.notes == direct.notes
    assert not np.allclose(again.x, logs.x)
    with pytest.raises(BadInput, match="are not those of the logs"):
        prepare(motor(BOTH), logs)


def test_jitter_is_taken_out_and_noted(tmp_path: Path) -> None:
    generator = np.random.default_rng(1)
    ideal = run(1000)
    t = np.sort(ideal["t"] + 0.0006 * generator.random(1000))
    log = {**ideal, "t": t, "angle": np.sin(3.0 * t)}
    logs = read_logs(write_folder(tmp_path, {"a": log, "b": ideal}), motor())
    assert logs.period == pytest.approx(0.002, rel=1e-3)
    clock = t[0] + logs.t[logs.rows(0)]
    np.testing.assert_allclose(logs.y[logs.rows(0), 0], np.sin(3.0 * clock), atol=1e-9)
    np.testing.assert_allclose(np.diff(logs.t[logs.rows(0)]), logs.period)
    (note,) = [note for note in logs.notes if "uniform clock" in note]
    assert "samples moved by up to" in note
    assert logs.u.min() >= ideal["voltage"].min() and logs.u.max() <= ideal["voltage"].max()


@pytest.mark.parametrize(("jitter", "rough"), [(0.0004, False), (0.0012, True)])
def test_strong_jitter_is_told_as_a_reason(tmp_path: Path, jitter: float, rough: bool) -> None:
    ideal = run(1000)
    t = np.sort(ideal["t"] + jitter * np.random.default_rng(1).random(1000))
    logs = read_logs(write_folder(tmp_path, {"a": {**ideal, "t": t}, "b": ideal}), motor())
    (note,) = [note for note in logs.notes if "uniform clock" in note]
    assert ("log the times of measurement" in note) is rough


def test_lost_samples_are_filled_in(tmp_path: Path) -> None:
    log = rows(run(), np.delete(np.arange(400), [100, 101, 250]))
    logs = read_logs(write_folder(tmp_path, {"a": log}), motor())
    assert logs.period == 0.002
    np.testing.assert_allclose(logs.y[:, 0], run()["angle"], atol=1e-9)


def test_clocks_that_differ_by_less_than_a_percent_meet(tmp_path: Path) -> None:
    runs = {name: run(period=period) for name, period in zip("abc", (0.002, 0.002, 0.00201), strict=True)}
    logs = read_logs(write_folder(tmp_path, runs), motor())
    assert logs.period == 0.002
    t = logs.t[logs.rows(2)]
    assert len(t) == 401
    np.testing.assert_allclose(logs.y[logs.rows(2), 0], np.sin(3.0 * t) + 0.1 * t, atol=1e-9)


def test_wrapped_angles_are_unwrapped(tmp_path: Path) -> None:
    t = run()["t"]
    angle = 20.0 * t + np.sin(3.0 * t)
    wrapped = np.mod(angle + np.pi, 2.0 * np.pi) - np.pi
    folder = write_folder(tmp_path, {"a": {**run(), "angle": wrapped}, "b": run()})
    logs = read_logs(folder, motor(BOTH))
    np.testing.assert_allclose(logs.y[logs.rows(0), 0], angle, atol=1e-9)
    np.testing.assert_array_equal(logs.y[logs.rows(1), 0], run()["angle"])
    assert "theta was unwrapped" in logs.notes


def test_only_angles_that_jump_by_a_turn_are_unwrapped(tmp_path: Path) -> None:
    step = np.where(run()["t"] < 0.4, 0.0, 4.5) + 0.1 * np.sin(run()["t"])
    turning = np.mod(20.0 * run()["t"], 2.0 * np.pi)
    for angle, shown in ((step, ANGLE), (turning, replace(ANGLE, unit="m"))):
        logs = read_logs(write_folder(tmp_path, {"a": {**run(), "angle": angle}}), motor([shown]))
        assert "theta was unwrapped" not in logs.notes


@pytest.mark.parametrize("delay", [0.01, 0.0113, -0.01, -0.0113])
def test_an_input_acts_after_its_delay_or_before_it_is_logged(tmp_path: Path, delay: float) -> None:
    log = {**run(), "voltage": 2.0 + 3.0 * run()["t"]}
    logs = read_logs(write_folder(tmp_path, {"a": log, "b": log}), motor(BOTH, input_delay=delay))
    assert logs.delays == (delay,)
    for i in range(2):
        acting = 2.0 + 3.0 * np.clip(log["t"] - delay, 0.0, log["t"][-1])
        np.testing.assert_allclose(logs.u[logs.rows(i), 0], acting, atol=1e-12)


def test_a_large_campaign_is_read_in_seconds(tmp_path: Path) -> None:
    log = run(10_000)
    folder = write_folder(tmp_path, {"a": log})
    (folder / "experiments.csv").write_text("id,file,m\n" + "".join(f"r{i},a.csv,1\n" for i in range(100)))
    start = perf_counter()
    logs = read_logs(folder, motor([*BOTH, Output("i", "A", "voltage", motor().x[2])]))
    assert len(logs.t) == 1_000_000
    assert perf_counter() - start < 20.0


def test_gaps_cut_a_log_into_experiments(tmp_path: Path) -> None:
    whole, standing = run(600), run(600)
    kept = np.r_[0:200, 300:340, 400:600]
    standing["angle"][400:] = 1.0
    cut = {name: rows(log, kept) for name, log in (("a", whole), ("b", standing))}
    logs = read_logs(write_folder(tmp_path, cut, group=["g", "h"]), motor())
    assert logs.ids == ("a.part1", "a.part2", "b.part1") and np.diff(logs.offsets).tolist() == [200, 200, 200]
    assert logs.experiments["group"].tolist() == ["g", "g", "h"]
    np.testing.assert_array_equal(logs.y[logs.rows(1), 0], whole["angle"][400:])
    (first, second) = [note for note in logs.notes if "was cut at gaps" in note]
    assert "its parts are a.part1 to a.part2; 40 of its 440 samples" in first
    assert "its parts are b.part1; 240 of its 440 samples" in second
    cut = {"a": rows(whole, np.r_[0:200, 300:600])}
    logs = read_logs(write_folder(tmp_path / "all", cut), motor())
    assert [note for note in logs.notes if "was cut" in note] == [
        "a was cut at gaps of more than 5 sampling periods: its parts are a.part1 to a.part2"
    ]


def test_logs_of_other_rates_are_read_at_the_slowest(tmp_path: Path) -> None:
    folder = write_folder(tmp_path, {"a": run(period=0.002), "b": run(period=0.005)})
    logs = read_logs(folder, motor())
    assert logs.period == 0.005
    t = logs.t[logs.rows(0)]
    np.testing.assert_allclose(logs.y[logs.rows(0), 0], np.sin(3.0 * t) + 0.1 * t, atol=1e-9)
    assert "0.002 to 0.005 s: all logs were read every 0.005 s" in " ".join(logs.notes)


def test_a_record_that_is_alone_is_cut_into_experiments(tmp_path: Path) -> None:
    system = motor(BOTH)
    alone = read_logs(write_folder(tmp_path / "one", {"a": run(430, 0.01)}), system)
    parts = several(system, alone)
    assert parts.ids == tuple(f"a.part{k}" for k in range(1, 9)) == tuple(parts.experiments["id"])
    np.testing.assert_array_equal(parts.y, alone.y)
    assert np.diff(parts.offsets).min() >= 53 and parts.offsets[-1] == 430
    np.testing.assert_allclose(parts.t[parts.offsets[:-1]], 0.0, atol=1e-12)
    assert "a is the only record: it was cut into 8 experiments of 0.537 s" in "".join(parts.notes)
    two = read_logs(write_folder(tmp_path / "two", {"a": run(430, 0.01), "b": run(430, 0.01)}), system)
    assert several(system, two) is two
    short = read_logs(write_folder(tmp_path / "short", {"a": run(99, 0.01)}), system)
    assert several(system, short) is short
