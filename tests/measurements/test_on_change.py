"""Values that are written when they change: no row means as before, in files and in long tables."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from tests.machines.folders import system_of
from tests.machines.known import refusals
from tests.measurements.recorders import tables
from unmodelled import Logs, read_logs
from unmodelled.cli.verbs.init import init
from unmodelled.logs.signals import over_steps
from unmodelled.systems.model import System

#: A tank that a pump fills, in steps of a metre: time of every row in s, level in m and flow in m^3/s.
HOUR = 3600.0
CLOCK = np.arange(0.0, 40.0 * HOUR, 10.0)
FLOW = np.where(np.sin(CLOCK / 5000.0) + 0.3 * np.sin(CLOCK / 1300.0) > 0.0, 0.02, 0.0)
LEVEL = 4.0 + np.cumsum(FLOW - 0.01 - 0.002 * np.sin(CLOCK / 9000.0)) * 10.0 / 40.0
STEP = 0.05

Rows = list[tuple[float, str]]


def on_change(values: np.ndarray, step: float) -> Rows:
    rounded = np.round(values / step) * step
    first = np.flatnonzero(np.diff(rounded, prepend=np.inf))
    return [(float(CLOCK[k]), f"{rounded[k]:.3f}") for k in first]


def rows_of(words: Mapping[int, str] | None = None) -> dict[str, Rows]:
    """Rows by sensor; some of those of the level hold a word."""
    level = on_change(LEVEL, STEP)
    level = [(t, (words or {}).get(k, cell)) for k, (t, cell) in enumerate(level)]
    return {"tank.level": level, "pump.flow": on_change(FLOW, 0.01)}


def date(seconds: float) -> str:
    return str((pd.Timestamp("2026-02-03T04:05:06Z") + pd.Timedelta(seconds=seconds)).isoformat())


def long_rows(rows: Mapping[str, Rows], blocks: bool) -> list[tuple[str, str, float]]:
    found = [(name, cell, t) for name, own in rows.items() for t, cell in own]
    return found if blocks else sorted(found, key=lambda row: row[2])


def write_csv(folder: Path, header: Sequence[str], rows: Sequence[tuple[str, str, float]]) -> None:
    lines = [",".join(header), *(f"{name},{cell},{date(t)}" for name, cell, t in rows)]
    (folder / "history.csv").write_text("\n".join(lines) + "\n")


def mapped(folder: Path, **keys: Any) -> Path:
    signals = {
        "h": {"column": "tank.level", "unit": "m", "hold": True},
        "Q": {"column": "pump.flow", "unit": "m^3/s", "hold": True},
    }
    content = {"schema": "mapping/1", "files": "history.*", "signals": signals, **keys}
    (folder / "mapping.yaml").write_text(yaml.safe_dump(content))
    return folder


def tank(folder: Path, constant: str = "") -> System:
    text = f"""
schema: system/1
name: tank
states: {{h: {{unit: m}}}}
inputs: {{Q: {{unit: m^3/s, hold: true}}}}
outputs: {{h: {{unit: m}}}}
{constant}
parameters: {{A: {{value: 40, unit: m^2}}, q: {{value: 0.01, unit: m^3/s}}}}
ports: {{fluid: {{effort: x, unit: m^3/s, position: h}}}}
dynamics: {{h: (Q - q - x)/A}}
"""
    return system_of(text, folder.with_name(f"{folder.name}-system"))


def assert_read(logs: Logs) -> None:
    """The level within a step, and the volume of the flow, on a uniform clock."""
    held = np.interp(logs.t, CLOCK, LEVEL)
    np.testing.assert_allclose(logs.y[:, 0], held, atol=1.01 * STEP)
    volume = np.cumsum(FLOW) * 10.0
    taken = np.cumsum(logs.u[:-1, 0]) * logs.period
    np.testing.assert_allclose(taken, np.interp(logs.t[1:], CLOCK + 10.0, volume), atol=0.3)


@pytest.mark.parametrize(
    ("header", "blocks"),
    [(("entity_id", "state", "last_changed"), True), (("what", "how much", "when"), False)],
)
def test_a_long_table_is_read_by_name(tmp_path: Path, header: Sequence[str], blocks: bool) -> None:
    write_csv(tmp_path, header, long_rows(rows_of(), blocks))
    logs = read_logs(mapped(tmp_path), tank(tmp_path))
    assert_read(logs)
    assert any("h holds from row to row: no row means that nothing changed" in note for note in logs.notes)


def test_a_file_per_sensor_has_the_clock_of_the_others(tmp_path: Path) -> None:
    """The files begin at other instants: dates count from the first one of all."""
    (tmp_path / "week").mkdir()
    for name, rows in rows_of().items():
        lines = [f"{date(t)},{cell}" for t, cell in rows]
        (tmp_path / "week" / f"{name.split('.')[1]}.csv").write_text("\n".join(["when,value", *lines]) + "\n")
    lost = rows_of()["pump.flow"][0][0]
    signals = {
        "h": {"column": "level.value", "hold": True},
        "Q": {"column": "flow.value", "hold": True},
    }
    folder = mapped(tmp_path, files="*/", time="when", signals=signals)
    assert lost == 0.0
    assert_read(read_logs(folder, tank(tmp_path)))
    flow = tmp_path / "week" / "flow.csv"
    flow.write_text("\n".join([(lines := flow.read_text().splitlines())[0], *lines[3:]]) + "\n")
    later = read_logs(folder, tank(tmp_path))
    begins = rows_of()["pump.flow"][2][0]
    assert len(later.t) * later.period == pytest.approx(CLOCK[-1] - begins, abs=2.0 * later.period)


@pytest.mark.parametrize("hold", [None, False])
def test_rows_show_what_is_written_on_change(tmp_path: Path, hold: bool | None) -> None:
    """A level with rests, in a mapping without `hold`: uneven times, a digit from row to row."""
    level = 4.0 + np.sin(CLOCK / 12000.0) ** 3 + 0.2 * np.sin(CLOCK / 5000.0)
    rows = {**rows_of(), "tank.level": on_change(level, STEP)}
    write_csv(tmp_path, ("entity_id", "state", "last_changed"), long_rows(rows, False))
    told = {} if hold is None else {"hold": hold}
    signals = {"h": {"column": "tank.level", **told}, "Q": {"column": "pump.flow"}}
    folder = mapped(tmp_path, signals=signals)
    if hold is False:
        assert refusals(lambda: read_logs(folder, tank(tmp_path)))
        return
    logs = read_logs(folder, tank(tmp_path))
    assert "h, Q are written on change; if not, write 'hold: false'" in logs.notes
    np.testing.assert_allclose(logs.y[:, 0], np.interp(logs.t, CLOCK, level), atol=1.01 * STEP)
    assert len(logs.ids) == 1


def test_a_coarse_sensor_of_a_clock_that_jitters_is_sampled(tmp_path: Path) -> None:
    """A fast coarse encoder whose rows nearly all change, by more than one digit."""
    t = np.cumsum(np.random.default_rng(3).uniform(2.0, 18.0, 2000))
    level = np.round(np.abs(t / 40.0 % 2.0 - 1.0) / STEP) * STEP
    assert np.mean(np.diff(level) != 0.0) > 0.9
    pd.DataFrame({"t": t, "level": level, "flow": np.cos(t / 60.0)}).to_csv(
        tmp_path / "history.csv", index=False
    )
    folder = mapped(tmp_path, time="t", signals={"h": "level", "Q": "flow"})
    logs = read_logs(folder, tank(tmp_path))
    assert not any("on change" in note for note in logs.notes)


def test_words_end_what_held_before(tmp_path: Path) -> None:
    """In a typed format, as texts and as nulls: an empty cell is as before, a word is not."""
    rows = long_rows(rows_of({40: "unavailable", 41: "unavailable", 42: "unknown"}), False)
    cells = {"sensor": [r[0] for r in rows], "value": [r[1] for r in rows], "at": [date(r[2]) for r in rows]}
    pq.write_table(pa.table(cells), tmp_path / "history.parquet")
    logs = read_logs(mapped(tmp_path), tank(tmp_path))
    assert "rows in which h is 'unavailable', missing until its next number: 2" in logs.notes
    assert "rows in which h is 'unknown', missing until its next number: 1" in logs.notes
    (whole,) = (table for table in tables(tmp_path / "history.parquet") if table.name == "tank.level")
    assert np.isnan(whole.columns["value"]).sum() == 3 and len(whole.words["value"]) == 3


def test_a_constant_holds_too(tmp_path: Path) -> None:
    rows = {**rows_of(), "weir": [(0.0, "1"), (10.0, "2"), (39.99 * HOUR, "2")]}
    write_csv(tmp_path, ("entity_id", "state", "last_changed"), long_rows(rows, False))
    constant = "operating_point: {m: {unit: m}}"
    system = tank(tmp_path, constant)
    signals = yaml.safe_load((mapped(tmp_path) / "mapping.yaml").read_text())["signals"]
    signals["h"]["column"] = "tank.level.state"
    late = {**rows, "weir": [(-HOUR, "1.5")]}
    write_csv(tmp_path, ("entity_id", "state", "last_changed"), long_rows(late, False))
    held = {"m": {"column": "weir.state", "hold": True}}
    logs = read_logs(mapped(tmp_path, constants=held, signals=signals), system)
    assert set(logs.c[:, 0]) == {1.5}
    write_csv(tmp_path, ("entity_id", "state", "last_changed"), long_rows(rows, False))
    (told,) = refusals(lambda: read_logs(tmp_path, system))
    assert "must keep one value in an experiment, it changes from 1 to 2" in told


def test_wide_tables_with_a_text_stay_as_they_are(tmp_path: Path) -> None:
    """An operating mode, runs that all start at 0 s, and two values beside a name."""
    t, x = np.tile(np.arange(50), 4), np.sin(np.arange(200.0))
    mode = np.repeat(["idle", "drive", "idle", "brake"], 50)
    for table in (
        {"t": np.arange(200), "x": x, "mode_name": mode},
        {"t": t, "x": x, "run": np.repeat(["a", "b", "c", "d"], 50)},
        {"t": t, "x": x, "y": x[::-1], "sensor": np.tile(["a", "b"], 100)},
    ):
        pd.DataFrame(table).to_csv(tmp_path / "a.csv", index=False)
        (only,) = tables(tmp_path / "a.csv")
        assert only.name == "" and only.clock is None


def test_means_over_steps_keep_what_flows() -> None:
    t, values = np.array([0.0, 1.5, 1.75]), np.array([2.0, 4.0, np.nan])
    instants = np.array([-1.0, 0.0, 1.0, 1.6, 2.0])
    np.testing.assert_allclose(
        over_steps(t, values, instants), [np.nan, 2.0, (0.5 * 2.0 + 0.1 * 4.0) / 0.6, np.nan, np.nan]
    )


def test_init_writes_hold_and_simulate_reads_it(tmp_path: Path) -> None:
    logs = tmp_path / "raw"
    logs.mkdir()
    write_csv(logs, ("entity_id", "state", "last_changed"), long_rows(rows_of(), False))
    init(logs, None, None, None)
    mapping = yaml.safe_load((logs / "mapping.yaml").read_text())
    assert all(signal["hold"] for signal in mapping["signals"].values()) and len(mapping["signals"]) == 2
    system = system_of((logs / "system.yaml").read_text(), tmp_path)
    assert system.inputs[0].hold
    assert read_logs(logs, system).period > 60.0


def test_init_reads_a_file_per_sensor_by_the_names_of_the_files(tmp_path: Path) -> None:
    """Where the column is called a value in all of them; files that have numbers only are experiments."""
    sensors, numbered = tmp_path / "sensors", tmp_path / "numbered"
    for folder, names in ((sensors, ("tank level", "pump flow")), (numbered, ("run 1", "run 2"))):
        folder.mkdir()
        for name, own in zip(names, rows_of().values(), strict=True):
            lines = ["when;value", *(f"{date(t)};{cell}" for t, cell in own)]
            (folder / f"{name}.csv").write_text("\n".join(lines))
    init(sensors, None, None, None)
    mapping = yaml.safe_load((sensors / "mapping.yaml").read_text())
    columns = {name: signal["column"] for name, signal in mapping["signals"].items()}
    assert columns == {"h": "tank level.value", "Q": "pump flow.value"}
    assert "among the columns 'value'" in refusals(lambda: init(numbered, None, None, None))[0]


def test_the_state_of_an_entity_is_no_position(tmp_path: Path) -> None:
    rows = {name.replace("tank.level", "sensor.hall"): own for name, own in rows_of().items()}
    write_csv(tmp_path, ("entity_id", "state", "last_changed"), long_rows(rows, False))
    told = refusals(lambda: init(tmp_path, None, None, None))[0]
    assert "no moving position and no level was found among the columns" in told and "sensor.hall" in told


def test_sampled_values_are_not_held(tmp_path: Path) -> None:
    """A clock that jitters, and a signal that repeats: both are sampled."""
    generator = np.random.default_rng(3)
    t = np.cumsum(generator.exponential(10.0, 800))
    smooth = np.sin(t / 500.0)
    for k, level in enumerate((smooth, np.round(10.0 * smooth) / 10.0)):
        logs = tmp_path / str(k)
        logs.mkdir()
        pd.DataFrame({"time_s": t, "level_m": level, "flow_m3_s": np.cos(t / 500.0)}).to_csv(
            logs / "a.csv", index=False
        )
        init(logs, None, None, None)
        assert "hold" not in (logs / "mapping.yaml").read_text()
