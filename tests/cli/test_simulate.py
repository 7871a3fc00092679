"""The verb simulate: what it writes, prints and refuses."""

import contextlib
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled as um
from tests.commands import exit_code
from tests.conftest import files_of
from tests.machines.folders import write_runs
from unmodelled.base.errors import BadInput
from unmodelled.base.files import read_json
from unmodelled.base.markers import MARKER
from unmodelled.cli.verbs.simulate import simulate
from unmodelled.diagnosis.data.persistence import default_horizon
from unmodelled.logs.folder import read_logs
from unmodelled.systems.reader import read_system

SYSTEM = """
schema: system/1
name: cart
states:
  x: {unit: m}
  v: {unit: m/s}
inputs:
  F: {unit: N, column: force}
outputs:
  x: {unit: m}
  v: {unit: m/s, column: speed}
parameters:
  m: {value: 2.0, unit: kg}
  k: {value: 0.0, unit: N/m^3}
dynamics:
  x: v
  v: (F + k*x**3)/m
"""


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """system.yaml and logs/ of a cart that a brake of 0.4 N slows down."""
    (tmp_path / "system.yaml").write_text(SYSTEM)
    tables = []
    for n in (120, 75):
        t = np.arange(n) * 0.01
        force = 3.0 + np.cos(4.0 * t)
        a, h = (force - 0.4) / 2.0, 0.01  # acceleration: straight lines from sample to sample
        speed = 1.0 + np.concatenate([[0.0], np.cumsum(h / 2.0 * (a[1:] + a[:-1]))])
        x = np.concatenate([[0.0], np.cumsum(h * speed[:-1] + h**2 / 6.0 * (2.0 * a[:-1] + a[1:]))])
        tables.append({"t": t, "x": x, "speed": speed, "force": force})
    write_runs(tmp_path / "logs", tables, id=["fast", "7"])
    return tmp_path


def call(case: Path, *arguments: str) -> int:
    """Exit code of the command, given in the folder of the case."""
    with contextlib.chdir(case):
        return exit_code("simulate", *arguments)


def within(table: pd.DataFrame, name: str) -> float:
    """Standard deviation of a measured output from the mean of its experiment."""
    measured = table.groupby("experiment")[f"{name}_measured"]
    return float(np.sqrt(np.mean((table[f"{name}_measured"] - measured.transform("mean")) ** 2)))


def test_what_is_written_and_printed(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, said = call(case, "system=system.yaml", "logs=logs", "horizon=0.1", "out=out"), capsys.readouterr()
    assert code == 0, said.err
    lines = said.out.splitlines()
    assert [line.split(":")[0] for line in lines] == [
        *("x", "v", "gap", "noise floor", "persistence", "worst experiment", "note")
    ]
    names = sorted(p.name for p in (case / "out").iterdir())
    assert names == [MARKER, "index.html", "simulation.json", "simulation.parquet"]
    summary = read_json(case / "out" / "simulation.json")
    table = pd.read_parquet(case / "out" / "simulation.parquet")
    names = [f"{name}_{kind}" for name in ("x", "v") for kind in ("measured", "simulated")]
    assert list(table) == ["experiment", "t", "window", *names]
    assert table["experiment"].tolist() == ["fast"] * 120 + ["7"] * 75
    assert table["window"].tolist() == [max(k - 1, 0) // 10 for n in (120, 75) for k in range(n)]
    assert (summary["schema"], summary["system"], summary["horizon"]) == ("simulation/1", "cart", 0.1)
    assert summary["integration"] == {"method": "rk4", "substeps": 1}
    predicted = table[table.groupby("experiment").cumcount() > 0]
    square = []
    for name, unit in (("x", "m"), ("v", "m/s")):
        entry = summary["outputs"][name]
        error = predicted[f"{name}_simulated"] - predicted[f"{name}_measured"]
        assert entry["unit"] == unit
        assert entry["std"] == pytest.approx(within(table, name))
        assert entry["rmse"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9)
        assert entry["gap"] == pytest.approx(entry["rmse"] / entry["std"])
        square.append(entry["gap"] ** 2)
    assert summary["gap"]["known"] == pytest.approx(np.sqrt(np.mean(square)))
    assert summary["gap"]["floor"] < 1e-6
    # the brake is missing: after k samples the speed is 0.2 k h too high
    k = np.concatenate([np.arange(n - 1) % 10 + 1 for n in (120, 75)])
    assert summary["outputs"]["v"]["rmse"] == pytest.approx(0.2 * 0.01 * np.sqrt(np.mean(k**2)), rel=1e-9)
    # ten samples after a start, and after those of the whole run
    errors = summary["gap"]["units"]["v"]
    whole = np.concatenate([np.arange(1, n) for n in (120, 75)])
    assert errors["unit"] == "m/s"
    assert errors["known"] == pytest.approx(0.2 * 0.01 * 10, rel=1e-6)
    assert errors["known_whole_run"] == pytest.approx(0.2 * 0.01 * np.sqrt(np.mean(whole**2)), rel=1e-6)
    assert lines[1] == "v: 0.02 m/s off after 0.1 s, 0.12 m/s over whole runs"
    assert [e["id"] for e in summary["experiments"]] == ["fast", "7"]
    worst = max(summary["experiments"], key=lambda e: float(e["known"]))
    assert lines[5].startswith(f"worst experiment: {worst['id']}, ")
    assert lines[4].startswith(f"persistence: {summary['gap']['persistence']:.3g}, ")
    # within so short a horizon, the change of the acceleration matters less than the missing brake
    assert summary["gap"]["floor"] < summary["gap"]["persistence"] < summary["gap"]["known"]
    assert lines[6] == f"note: {summary['notes'][-1]}" and "than persistence" in lines[6]


@pytest.mark.long
def test_the_default_horizon_is_chosen_from_all_logs(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for only in ([], ["only=fast"]):
        assert call(case, "system=system.yaml", "logs=logs", *only, "out=out") == 0
        horizon = read_json(case / "out" / "simulation.json")["horizon"]
        assert horizon == default_horizon(read_logs(case / "logs", read_system(case / "system.yaml"))) != 0.1
        assert f" off after {horizon:.3g} s, " in capsys.readouterr().out


def test_a_model_that_persistence_beats_has_a_note(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (case / "system.yaml").read_text().replace("value: 2.0", "value: -0.1")
    (case / "system.yaml").write_text(text)
    assert call(case, "system=system.yaml", "logs=logs", "out=out") == 0
    (note,) = (line for line in capsys.readouterr().out.splitlines() if "than persistence" in line)
    assert note.removeprefix("note: ") in read_json(case / "out" / "simulation.json")["notes"]


def test_a_bad_system_file_and_a_missing_folder_are_named(case: Path) -> None:
    (case / "other.yaml").write_text(SYSTEM.replace("(F + ", "(F_x + "))
    with pytest.raises(BadInput, match=r"other\.yaml: line 17.*F_x"):
        simulate(case / "other.yaml", case / "logs", 0.1, case / "out")
    with pytest.raises(BadInput, match="nowhere: no such folder"):
        simulate(case / "system.yaml", case / "nowhere", 0.1, case / "out")
    assert not (case / "out").exists()


def test_a_bad_log_names_file_row_and_column_and_keeps_the_old_result(case: Path) -> None:
    out = case / "out"
    simulate(case / "system.yaml", case / "logs", 0.1, out)
    before = files_of(out)
    lines = (case / "logs" / "run1.csv").read_text().splitlines()
    lines[5] = "0.04,oops,1,3"
    (case / "logs" / "run1.csv").write_text("\n".join(lines))
    with pytest.raises(BadInput, match=r"run1\.csv: row 6.*column x.*'oops'"):
        simulate(case / "system.yaml", case / "logs", 0.1, out)
    assert files_of(out) == before


def test_some_of_the_experiments(case: Path) -> None:
    simulate(case / "system.yaml", case / "logs", 0.1, case / "all")
    simulate(case / "system.yaml", case / "logs", 0.1, case / "one", [7])  # type: ignore[list-item]
    summary = read_json(case / "one" / "simulation.json")
    table = pd.read_parquet(case / "one" / "simulation.parquet")
    assert [e["id"] for e in summary["experiments"]] == ["7"]
    assert summary["gap"]["known"] == summary["experiments"][0]["known"]
    both = pd.read_parquet(case / "all" / "simulation.parquet")
    assert summary["outputs"]["x"]["std"] == pytest.approx(within(both, "x"))
    pd.testing.assert_frame_equal(table, both[both["experiment"] == "7"].reset_index(drop=True))
    for only, words in (("8", "only: there is no experiment '8'"), ([], "only: names no experiment")):
        with pytest.raises(BadInput, match=words):
            simulate(case / "system.yaml", case / "logs", 0.1, case / "none", only)


def test_a_diverging_system_gives_finite_numbers(case: Path) -> None:
    (case / "system.yaml").write_text(SYSTEM.replace("value: 0.0, unit: N/m^3", "value: 1e9, unit: N/m^3"))
    simulate(case / "system.yaml", case / "logs", 0.1, case / "out")

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    summary = json.loads((case / "out" / "simulation.json").read_text(), parse_constant=refuse)
    assert 1.0 < summary["gap"]["known"] <= 10.0
    assert any("diverged" in note for note in summary["notes"])
    table = pd.read_parquet(case / "out" / "simulation.parquet").select_dtypes("number")
    assert np.isfinite(table.to_numpy()).all()


def test_an_offset_of_one_experiment_hides_no_gap(case: Path) -> None:
    """Its speed in another place of the register: the error of that run is as large as it is."""
    simulate(case / "system.yaml", case / "logs", 0.1, case / "before")
    log = pd.read_csv(case / "logs" / "run1.csv")
    log.assign(x=log["x"] + 1e9).to_csv(case / "logs" / "run1.csv", index=False)
    simulate(case / "system.yaml", case / "logs", 0.1, case / "after")
    before, after = (read_json(case / out / "simulation.json") for out in ("before", "after"))
    assert after["outputs"]["x"]["std"] == pytest.approx(before["outputs"]["x"]["std"], rel=1e-6)
    gaps = [{e["id"]: e["known"] for e in about["experiments"]} for about in (before, after)]
    assert gaps[1]["fast"] == pytest.approx(gaps[0]["fast"], rel=1e-6)
    assert after["gap"]["known"] > 0.5 * before["gap"]["known"]


def test_an_id_between_dollar_signs_is_a_name_and_no_formula(case: Path) -> None:
    (case / "logs" / "experiments.csv").write_text("id,file\n$x^$,run0.csv\n$\\frac{$,run1.csv\n")
    simulate(case / "system.yaml", case / "logs", 0.1, case / "out")
    assert "$x^$" in (case / "out" / "index.html").read_text()
    system = read_system(case / "system.yaml")
    found = um.simulate(system, read_logs(case / "logs", system), 0.1)
    for name in ("$x^$", "$\\frac{$"):
        assert "<svg" in found.plot(name)._repr_svg_()  # type: ignore[attr-defined]
