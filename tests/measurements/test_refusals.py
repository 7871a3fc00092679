"""Bad log folders: one clear line that names file, row and column."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.measurements.systems import motor, run, write_folder
from unmodelled.base.errors import BadInput
from unmodelled.logs.folder import read_logs

Change = Callable[[Path], None]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_folder(tmp_path / "logs", {"a": run(), "b": run()}, group=["g", "g"])


def cells(row: int, column: int, value: str, name: str = "b.csv") -> Change:
    """Put `value` in a cell, rows and columns counted from 1."""

    def change(folder: Path) -> None:
        lines = (folder / name).read_text().splitlines()
        line = lines[row - 1].split(",")
        line[column - 1] = value
        lines[row - 1] = ",".join(line)
        (folder / name).write_text("\n".join(lines) + "\n")

    return change


def text(value: str | bytes, name: str = "b.csv") -> Change:
    def change(folder: Path) -> None:
        (folder / name).write_bytes(value if isinstance(value, bytes) else value.encode())

    return change


def lines(edit: Callable[[list[str]], list[str]], name: str = "b.csv") -> Change:
    def change(folder: Path) -> None:
        (folder / name).write_text("\n".join(edit((folder / name).read_text().splitlines())) + "\n")

    return change


def log(name: str = "b", suffix: str = "csv", **columns: np.ndarray) -> Change:
    """Replace columns of a log."""

    def change(folder: Path) -> None:
        write_folder(folder, {name: {**run(), **columns}}, suffix)
        table = "id,file,m\na,a.csv,0.5\nb,b." + suffix + ",0.5\n"
        (folder / "experiments.csv").write_text(table)

    return change


def without(file: str) -> Change:
    return lambda folder: (folder / file).unlink()


T = run()["t"]
GAPS = T + 0.02 * (np.arange(400) // 40)
CLOCK = "row 1: column t"
TABLE = "experiments.csv"

BAD: list[tuple[Change, str]] = [
    (without(TABLE), r"experiments.csv: no such file"),
    (without("b.csv"), r"experiments.csv: row 3: column file: 'b.csv': no such file"),
    (text("", TABLE), "experiments.csv: row 1: must name the columns"),
    (text("id,file,m\n", TABLE), "experiments.csv: row 1: column id: no experiments"),
    (text("id,file\na,a.csv\n", TABLE), "experiments.csv: row 1: column m is missing"),
    (text("file,m\na.csv,1\n", TABLE), "experiments.csv: row 1: column id is missing"),
    (text("id,m\na,1\n", TABLE), "experiments.csv: row 1: column file is missing"),
    (text("id,file,m,m\na,a.csv,1,1\n", TABLE), "experiments.csv: row 1: column 'm' stands there 2 times"),
    (text("id,file,m\na,a.csv\n", TABLE), "experiments.csv: row 2: must have 3 columns like row 1, got 2"),
    (text("id,file,m\na,a.csv,1\n\n,b.csv,1\n", TABLE), "experiments.csv: row 4: column id: is empty"),
    (text("id,file,m\na,,1\n", TABLE), "experiments.csv: row 2: column file: is empty"),
    (text("id,file,m\na,a.csv,1\na,b.csv,1\n", TABLE), "row 3: column id: 'a' stands in row 2 already"),
    (text(b"id,file,m\n\xff,a.csv,1\n", TABLE), "experiments.csv: not a table"),
    (cells(3, 3, "heavy", TABLE), "experiments.csv: row 3: column m: 'heavy' is not a finite number"),
    (cells(3, 3, "", TABLE), "experiments.csv: row 3: column m: '' is not a finite number"),
    (cells(3, 3, "inf", TABLE), "experiments.csv: row 3: column m: 'inf' is not a finite number"),
    (cells(3, 3, "1e999", TABLE), "experiments.csv: row 3: column m: '1e999' is not a finite number"),
    (cells(3, 2, "/etc/passwd", TABLE), "row 3: column file: '/etc/passwd' must lie in the folder"),
    (cells(3, 2, "../b.csv", TABLE), r"row 3: column file: '../b.csv' must lie in the folder"),
    (cells(3, 2, "..\\b.csv", TABLE), r"row 3: column file: .* must lie in the folder"),
    (cells(3, 2, "C:\\b.csv", TABLE), r"row 3: column file: .* must lie in the folder"),
    (cells(3, 2, ".", TABLE), r"row 3: column file: '.': no such file"),
    (cells(3, 2, "b\0.csv", TABLE), r"row 3: column file: .* no such file"),
    (text(""), "b.csv: row 1: must name the columns"),
    (text("\n\nt,angle,voltage\n"), "b.csv: row 1: must name the columns"),
    (text("t,angle,voltage\n"), f"b.csv: {CLOCK}: no rows"),
    (text(b"\x89PNG\r\n\x1a\n\xff\xfe"), "b.csv: not a table"),
    (text(b"PAR1 and then nothing of the kind"), "b.csv: not a table"),
    (cells(1, 1, "time"), "b.csv: row 1: column t is missing"),
    (cells(1, 2, "phi"), "b.csv: row 1: column angle is missing"),
    (cells(1, 4, "volts"), "b.csv: row 1: column voltage is missing"),
    (cells(1, 3, "angle"), "b.csv: row 1: column 'angle' stands there 2 times"),
    (cells(7, 2, "abc"), "b.csv: row 7: column angle: 'abc' is not a finite number"),
    (cells(7, 2, ""), "b.csv: row 7: column angle: '' is not a finite number"),
    (cells(7, 2, "nan"), "b.csv: row 7: column angle: 'nan' is not a finite number"),
    (cells(7, 4, "-inf"), "b.csv: row 7: column voltage: '-inf' is not a finite number"),
    (cells(7, 4, "1e999"), "b.csv: row 7: column voltage: '1e999' is not a finite number"),
    (cells(7, 4, "-1e200"), "b.csv: row 7: column voltage: '-1e200' is not a finite number below 1e\\+100"),
    (cells(7, 4, "0x1F"), "b.csv: row 7: column voltage: '0x1F' is not a finite number"),
    (cells(7, 4, "1_0"), "b.csv: row 7: column voltage: '1_0' is not a finite number"),
    (cells(7, 1, "?"), "b.csv: row 7: column t: '\\?' is not a finite number"),
    (cells(7, 4, '"12\n13"'), r"b.csv: row 8: column voltage: '12\\n13' is not a finite number"),
    (cells(7, 2, "1,0"), "b.csv: row 7: must have 4 columns like row 1, got 5"),
    (
        lines(lambda rows: [*rows[:9], "", *rows[9:20], "x,y"]),
        "row 22: must have 4 columns like row 1, got 2",
    ),
    (cells(7, 1, "0.001"), "b.csv: row 7: column t: time must increase, 0.001 s follows 0.008 s"),
    (lines(lambda rows: [*rows[:6], "", *rows[5:]]), "b.csv: row 8: column t: time must increase"),
    (lines(lambda rows: rows[:41]), "b.csv: row 41: column t: must have 50 samples or more, got 40"),
    (
        log(t=GAPS),
        "b.csv: row 42: column t: gap of 0.022 s, more than 5 sampling periods of 0.002 s: no part",
    ),
    (
        log(t=1e3 * T),
        "row 3: column t: median sampling period of 2 s, 0.002 s in .*: it looks like milliseconds",
    ),
    (log(t=0.1 * T), "row 2: column t: 0.0798 s hold fewer than 50 samples of 0.002 s"),
    (log(angle=np.full(400, 0.25)), "b.csv: row 2: column angle: dead output, 0.25 in every row"),
    (log(suffix="parquet", t=GAPS), "b.parquet: row 41: column t: gap of 0.022 s"),
    (
        log(suffix="parquet", angle=np.where(np.arange(400) == 7, np.inf, T)),
        "b.parquet: row 8: column angle: inf is not a finite number",
    ),
    (
        log(suffix="parquet", angle=pd.array([1, None] * 200, dtype="Int64")),
        "b.parquet: row 2: column angle: an empty cell is not a finite number",
    ),
    (
        log(suffix="parquet", angle=np.array(["1.0"] * 400)),
        "b.parquet: row 1: column angle: '1.0' is not a finite number",
    ),
    (log(suffix="parquet", angle=T > 0.1), "b.parquet: row 1: column angle: 'False' is not a finite number"),
    (text("{}", "provenance.json"), "provenance.json: data is missing"),
    (text("{", "provenance.json"), "provenance.json: not a JSON file"),
]


@pytest.mark.parametrize(("change", "message"), BAD, ids=[message[-50:] for _, message in BAD])
def test_refused_with_one_line(folder: Path, change: Change, message: str) -> None:
    change(folder)
    with pytest.raises(BadInput, match=message) as refused:
        read_logs(folder, motor())
    assert "\n" not in str(refused.value)
    assert str(folder) in str(refused.value)


def test_a_folder_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="nowhere: no such folder"):
        read_logs(tmp_path / "nowhere", motor())


@pytest.mark.long
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    name=st.sampled_from(["b.csv", TABLE]),
    edits=st.lists(
        st.tuples(
            st.floats(0.0, 1.0),
            st.integers(0, 6),
            st.one_of(
                st.sampled_from(
                    [b",", b"\n", b"\r\n", b'"', b"nan", b"-", b"e", b"9", b".", b"\0", b"\xff", b";"]
                ),
                st.binary(max_size=4),
            ),
        ),
        max_size=4,
    ),
)
def test_mutations_are_refused_or_read(
    tmp_path_factory: pytest.TempPathFactory, name: str, edits: list[tuple[float, int, bytes]]
) -> None:
    folder = write_folder(tmp_path_factory.mktemp("mutated"), {"a": run(60), "b": run(60)})
    content = (folder / name).read_bytes()
    for place, cut, put in edits:
        at = int(place * len(content))
        content = content[:at] + put + content[at + cut :]
    (folder / name).write_bytes(content)
    try:
        logs = read_logs(folder, motor())
    except BadInput as refused:
        assert "\n" not in str(refused)
        return
    for values in (logs.t, logs.y, logs.u, logs.c, logs.x):
        assert np.isfinite(values).all()
