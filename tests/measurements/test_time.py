"""Time as recorders write it: any unit, dates, stamps since 1970 and stamps that are nearly equal."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.measurements.systems import ANGLE, SPEED, motor, refused, run, write
from tests.measurements.test_mapping import assert_equal
from unmodelled import BadInput, Logs, read_logs
from unmodelled.design.limits import read_limits
from unmodelled.design.written import read_experiment, write_experiment
from unmodelled.logs.record import from_start, in_order
from unmodelled.logs.time_units import on_clock, seconds_of
from unmodelled.systems.units import parse_logged

LOG = run(200)
TABLE = pd.DataFrame({"m": [0.5]}, index=["a"])


def read(folder: Path, time: object, **columns: object) -> Logs:
    log = {**{name: column for name, column in LOG.items() if name != "t"}, **columns}
    return read_logs(write(folder, {"a": log}, time=time), motor())


@pytest.mark.parametrize(
    ("name", "unit", "size"),
    [
        ("t", "h", 3600.0),
        ("t", "min", 60.0),
        ("t", "d", 86_400.0),
        ("elapsed_hours", None, 3600.0),
        ("time (min)", None, 60.0),
        ("timeMinutes", None, 60.0),
        ("Zeit [Std]", None, 3600.0),
        ("time (Min)", None, 60.0),
        ("stamp_us", None, 1e-6),
        ("time_ms", None, 1e-3),
        ("ms", None, 1e-3),
        ("us", None, 1e-6),
        ("h", None, 3600.0),
    ],
)
def test_units_of_time(tmp_path: Path, name: str, unit: str | None, size: float) -> None:
    column = {"column": name.partition(" ")[0], **({"unit": unit} if unit else {})}
    logs = read(tmp_path, column, **{name: LOG["t"] / size})
    assert logs.period == pytest.approx(0.002, rel=1e-6) and len(logs.t) == 200


@pytest.mark.parametrize("first", [739_950.52, 46_001.25, 2_461_000.3, 20_440.1])
def test_counts_of_days_are_days_without_a_unit(tmp_path: Path, first: float) -> None:
    """MATLAB's datenum, a spreadsheet's dates, Julian days, days since 1970, at 20 Hz."""
    t = np.arange(200) * 0.05
    logs = read(tmp_path, "clock", clock=first + t / 86_400.0)
    assert logs.period == pytest.approx(0.05, rel=1e-3)
    assert "time clock was read in d, by its name or its numbers" in logs.notes
    np.testing.assert_allclose(logs.y[:, 0], LOG["angle"], atol=2e-4 if first < 1e6 else 5e-3)


def test_seconds_stay_seconds(tmp_path: Path) -> None:
    """Of a machine that has been on for a day, at 10 kHz."""
    logs = read(tmp_path, "clock", clock=86_000.0 + np.arange(200) * 1e-4)
    assert logs.period == pytest.approx(1e-4, rel=1e-6)


def test_days_in_a_tidy_log_are_refused() -> None:
    frame = pd.DataFrame({**LOG, "t": 739_950.5 + LOG["t"] / 86_400.0})
    with pytest.raises(BadInput, match=r"row 1: column t: must be in s, 739950\.5 looks like days"):
        Logs.from_frames({"a": frame}, motor(), TABLE)


@pytest.mark.parametrize(
    "column",
    [
        pd.Timestamp("2026-03-01T10:00Z") + pd.to_timedelta(LOG["t"], "s"),
        pd.Timestamp("2026-03-01T10:00") + pd.to_timedelta(LOG["t"], "s"),
        pd.to_timedelta(LOG["t"] + 77.0, "s"),
        pd.Series([pd.Timestamp("2026-03-01") + pd.Timedelta(t, "s") for t in LOG["t"]], dtype=object),
    ],
)
def test_dates_and_durations_in_a_data_frame_are_time(column: object) -> None:
    found = Logs.from_frames({"a": pd.DataFrame({**LOG, "t": column})}, motor(), TABLE)
    expected = Logs.from_frames({"a": pd.DataFrame(LOG)}, motor(), TABLE)
    assert found.period == pytest.approx(0.002, rel=1e-6)
    np.testing.assert_allclose(found.y, expected.y, atol=1e-9)


def test_a_date_that_is_missing_is_no_time() -> None:
    stamps = pd.Series(pd.Timestamp("2026-03-01") + pd.to_timedelta(LOG["t"], "s"))
    stamps[7] = pd.NaT
    with pytest.raises(BadInput, match=r"frames\['a'\]: row \d+: column t"):
        Logs.from_frames({"a": pd.DataFrame({**LOG, "t": stamps})}, motor(), TABLE)


def test_nanoseconds_in_a_parquet_file_are_subtracted_as_integers(tmp_path: Path) -> None:
    ticks = 1_764_041_247_000_000_000 + np.arange(200) * 100
    log = {name: LOG[name] for name in ("angle", "voltage")}
    pq.write_table(pa.table({"t": pa.array(ticks, pa.timestamp("ns")), **log}), tmp_path / "a.parquet")
    logs = read_logs(write(tmp_path, {}, files="a.parquet", time="t"), motor())
    assert logs.period == pytest.approx(1e-7, rel=1e-9)


def test_messages_that_arrive_together_are_read_by_the_time_of_receipt(tmp_path: Path) -> None:
    """A stamp of 50 Hz for ten messages; now and then messages are held up, then 0.24 us apart."""
    generator = np.random.default_rng(4)
    log = run(2000)
    arrival = log["t"] + np.abs(generator.normal(0.0, 2e-4, 2000)) + (generator.random(2000) < 0.01) * 7e-3
    receipt = 1.78e9 + np.maximum.accumulate(arrival) + np.arange(2000) * 2.4e-7
    stamp = 1.78e9 + np.floor(log["t"] / 0.02) * 0.02
    raw = {**log, "stamp": stamp, "receipt": receipt}
    logs = read_logs(write(tmp_path, {"a": raw}, time="receipt"), motor())
    assert logs.period == pytest.approx(0.002, rel=5e-3)
    # late by 0.16 ms on average, as a constant delay of all signals
    error = logs.y[:, 0] - np.interp(logs.t, log["t"] + 1.6e-4, log["angle"])
    assert np.std(error) < 2e-3 and np.abs(error).max() < 0.02
    told = refused(write(tmp_path, {"a": raw}, time="stamp"))
    assert "rows repeat a time stamp: the clock is too coarse" in told


def test_stamps_that_differ_stay_different() -> None:
    t = 1.78e9 + np.arange(100) * 5e-7
    assert (np.diff(from_start(t)) > 0.0).all()
    # what a recorder writes in bursts, all of it within a period, is left as it is
    bursts = np.repeat(np.arange(50) * 0.01, 2) + np.tile([0.0, 1e-6], 50)
    rows, _, repeated = in_order(bursts, np.arange(100))
    assert len(rows) == 100 and repeated == 0


def test_epoch_seconds_with_jitter_and_turns(tmp_path: Path) -> None:
    """Seconds since 1970 at 90 Hz with 15 % of jitter; an angle in turns, a speed in rev/s."""
    generator = np.random.default_rng(6)
    t = np.cumsum(generator.normal(0.011, 0.0015, 900).clip(0.007, 0.025))
    raw = {"t": 1_764_041_247.31 + t, "angle": np.sin(3.0 * t), "voltage": t, "speed": 3.0 * np.cos(3.0 * t)}
    signals = {"angle": {"column": "angle", "unit": "turn"}, "voltage": "voltage"}
    signals["speed"] = {"column": "speed", "unit": "rev/s"}
    system = motor([ANGLE, replace(SPEED, logged=parse_logged("rpm")[1])])
    logs = read_logs(write(tmp_path, {"a": raw}, time={"column": "t", "unit": "s"}, signals=signals), system)
    assert logs.period == pytest.approx(np.median(np.diff(t)), rel=0.02)
    at = logs.t + t[0]
    np.testing.assert_allclose(logs.y[:, 0], 2.0 * np.pi * np.sin(3.0 * at), atol=1e-4)
    np.testing.assert_allclose(logs.y[:, 1], 2.0 * np.pi * 3.0 * np.cos(3.0 * at), atol=2e-4)


@pytest.mark.parametrize(
    ("scale", "factor"), [("360/2000", 0.18), ("2*pi/4096", np.pi / 2048), ("-1e-3", -1e-3)]
)
def test_a_scale_may_be_an_expression(tmp_path: Path, scale: str, factor: float) -> None:
    signals = {"angle": {"column": "angle", "scale": scale, "offset": "1/4"}, "voltage": "voltage"}
    logs = read_logs(write(tmp_path, {"a": LOG}, signals=signals), motor())
    np.testing.assert_allclose(logs.y[:, 0], factor * LOG["angle"] + 0.25, rtol=1e-12)


SCALES = ["2*x", "t", "1/0", "__import__('os')", "[1]", "1e999", "1e308", "9**9**9", "1e99"]


@pytest.mark.parametrize("scale", SCALES)
def test_scales_that_are_no_number_or_beyond_any_measurement_are_refused(tmp_path: Path, scale: str) -> None:
    signals = {"angle": {"column": "angle", "scale": scale}, "voltage": "voltage"}
    told = refused(write(tmp_path, {"a": {**LOG, "angle": 1e5 * LOG["angle"]}}, signals=signals))
    words = "times its scale is above 1e+100" if scale == "1e99" else "signals.angle.scale: must be"
    assert words in told


def test_equal_logs_from_equal_clocks(tmp_path: Path) -> None:
    found = read(tmp_path / "days", "t", t=pd.Timestamp("2026-03-01") + pd.to_timedelta(LOG["t"], "s"))
    assert_equal(found, read(tmp_path / "seconds", "t", t=LOG["t"]))


@pytest.mark.parametrize("unit", ["ms", "us", "min"])
def test_places_and_files_are_in_the_unit_of_the_users_clock(tmp_path: Path, unit: str) -> None:
    """A spike is told at the time of the log, and an experiment is written and read back on the clock."""
    size, logs, system = seconds_of(unit) or 1.0, {"a": run(400), "b": run(400)}, motor()
    logs["a"]["angle"][200] += 500.0
    raw = {name: {**log, "t": log["t"] / size} for name, log in logs.items()}
    found = read_logs(write(tmp_path, raw, time={"column": "t", "unit": unit}), system)
    place = on_clock(float(logs["a"]["t"][200]), unit)
    assert place.endswith(f" {unit}") and any(f"t = {place} of a" in note for note in found.notes)
    found.write(tmp_path / "store")
    assert read_logs(tmp_path / "store", system).clock == unit
    limits = tmp_path / "limits.yaml"
    limits.write_text(
        "duration: 1\ninputs: {V: {low: -10, high: 10}}\nstart: {theta: 0}\noperating_point: {m: 0.2}\n"
    )
    own = read_limits(limits, system, found)
    u = np.sin(np.linspace(0.0, 2.0 * np.pi, own.samples))[:, None]
    written = tmp_path / "experiment.csv"
    write_experiment(u, system, own, written, lambda u: [])
    assert pd.read_csv(written).columns[0] == f"t_{unit}"
    t, again = read_experiment(written, system, own, "experiment")
    np.testing.assert_allclose(t, own.period * np.arange(own.samples), atol=1e-8)
    np.testing.assert_allclose(again, u, atol=1e-8)


def test_runs_of_another_sampling_period_are_named(tmp_path: Path) -> None:
    """Their clock may be wrong."""
    tables = {name: run(120) for name in "abcdef"}
    for name in "ce":
        tables[name]["t"] = 0.9 * np.asarray(tables[name]["t"])
    notes = read_logs(write(tmp_path, tables), motor()).notes
    assert "differ, 0.002 s but 0.0018 s in c, e: all logs were read every 0.002 s" in "".join(notes)
