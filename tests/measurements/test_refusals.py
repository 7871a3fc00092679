"""Bad log folders and tables of other programs: one clear line with file, row and column, and what to do."""

import gzip
import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from tests.machines.folders import logs_of
from tests.machines.known import refusals
from tests.measurements.systems import motor, run, write_folder
from tests.physics.robot.mechanisms import system_of
from tests.physics.robot.test_motion import DOUBLE
from unmodelled import BadInput, read_logs
from unmodelled.base.arrays import Array
from unmodelled.logs.logs import Logs

Change = Callable[[Path], object]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_folder(tmp_path / "logs", {"a": run(), "b": run()}, group=["g", "g"])


def text(value: str | bytes, name: str = "b.csv") -> Change:
    data = value if isinstance(value, bytes) else value.encode()
    return lambda folder: (folder / name).write_bytes(data)


def table(value: str | bytes) -> Change:
    return text(value, TABLE)


def lines(edit: Callable[[list[str]], list[str]], name: str = "b.csv") -> Change:
    def change(folder: Path) -> None:
        (folder / name).write_text("\n".join(edit((folder / name).read_text().splitlines())) + "\n")

    return change


def cells(row: int, column: int, value: str, name: str = "b.csv") -> Change:
    """Put `value` in a cell, rows and columns counted from 1."""

    def edit(rows: list[str]) -> list[str]:
        cells = rows[row - 1].split(",")
        cells[column - 1] = value
        return [*rows[: row - 1], ",".join(cells), *rows[row:]]

    return lines(edit, name)


def log(suffix: str = "csv", **columns: np.ndarray) -> Change:
    def change(folder: Path) -> None:
        write_folder(folder, {"b": {**run(), **columns}}, suffix)
        (folder / TABLE).write_text(f"id,file,m\na,a.csv,0.5\nb,b.{suffix},0.5\n")

    return change


def rename(old: str, new: str) -> Change:
    return lambda folder: (folder / old).rename(folder / new)


T = run()["t"]
GAPS = T + 0.02 * (np.arange(400) // 40)
SHORT_ROW = lines(lambda rows: [*rows[:9], "", *rows[9:20], "x,y"])
CLOCK = "row 1: column t"
GAP, MEDIAN = "column t: gap of 0.022 s", "column t: median sampling period"
TABLE = "experiments.csv"
NUMBER = "is not a finite number"

BAD: list[tuple[Change, str]] = [
    (rename("b.csv", "c.csv"), r"experiments.csv: row 3: column file: 'b.csv': no such file"),
    (table(""), "experiments.csv: row 1: must name the columns"),
    (table("id,file,m\n"), "experiments.csv: row 1: column id: no experiments"),
    (table("id,file\na,a.csv\n"), "experiments.csv: row 1: column m is missing"),
    (table("file,m\na.csv,1\n"), "experiments.csv: row 1: column id is missing"),
    (table("id,m\na,1\n"), "experiments.csv: row 1: column file is missing"),
    (table("id,file,m,m\na,a.csv,1,1\n"), "experiments.csv: row 1: column 'm' stands there 2 times"),
    (table("id,file,m\na,a.csv\n"), "experiments.csv: row 2: must have 3 columns like row 1, got 2"),
    (table("id,file,m\na,a.csv,1\n\n,b.csv,1\n"), "experiments.csv: row 4: column id: is empty"),
    (table("id,file,m\na,,1\n"), "experiments.csv: row 2: column file: is empty"),
    (table("id,file,m\na,a.csv,1\na,b.csv,1\n"), "row 3: column id: 'a' stands in row 2 already"),
    (table(b"id,file,m\n\xff,a.csv,1\n"), "experiments.csv: not a table"),
    *(
        (cells(3, 3, value, TABLE), f"experiments.csv: row 3: column m: '{value}' {NUMBER}")
        for value in ("heavy", "", "inf", "1e999")
    ),
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
    *((cells(7, 2, bad), f"b.csv: row 7: column angle: '{bad}' {NUMBER}") for bad in ("abc", "", "nan")),
    *(
        (cells(7, 4, bad), f"b.csv: row 7: column voltage: '{bad}' {NUMBER}")
        for bad in ("-inf", "1e999", "0x1F", "1_0")
    ),
    (cells(7, 4, "-1e200"), rf"b.csv: row 7: column voltage: '-1e200' {NUMBER} below 1e\+100"),
    (cells(7, 1, "?"), rf"b.csv: row 7: column t: '\?' {NUMBER}"),
    (cells(7, 4, '"12\n13"'), rf"b.csv: row 8: column voltage: '12\\n13' {NUMBER}"),
    (cells(7, 2, "1,0"), "b.csv: row 7: must have 4 columns like row 1, got 5"),
    (SHORT_ROW, "row 22: must have 4 columns like row 1, got 2"),
    (cells(7, 1, "0.001"), "b.csv: row 7: column t: time must increase, 0.001 s follows 0.008 s"),
    (lines(lambda rows: [*rows[:6], "", *rows[5:]]), "b.csv: row 8: column t: time must increase"),
    (lines(lambda rows: rows[:41]), "b.csv: row 41: column t: must have 50 samples or more, got 40"),
    (log(t=GAPS), f"b.csv: row 42: {GAP}, more than 5 sampling periods of 0.002 s: no part"),
    (
        log(t=1e3 * T),
        rf"row 3: {MEDIAN} of 2 s, 0.002 s in .*: it looks like milliseconds; multiply the column by 0\.001",
    ),
    (log(t=0.1 * T), "row 2: column t: 0.0798 s hold fewer than 50 samples of 0.002 s"),
    (log(angle=np.full(400, 0.25)), "b.csv: row 2: column angle: dead output, 0.25 in every row"),
    (log(suffix="parquet", t=GAPS), f"b.parquet: row 41: {GAP}"),
    *(
        (log(suffix="parquet", angle=angle), f"b.parquet: {place}: column angle: {value} {NUMBER}")
        for angle, place, value in [
            (np.where(np.arange(400) == 7, np.inf, T), "row 8", "inf"),
            (pd.array([1, None] * 200, dtype="Int64"), "row 2", "an empty cell"),
            (np.array(["1.0"] * 400), "row 1", "'1.0'"),
            (T > 0.1, "row 1", "'False'"),
        ]
    ),
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


TEXT = pd.DataFrame(run()).round(6).to_csv(index=False)
HEADER, *LINES = TEXT.splitlines()
SEMICOLONS = TEXT.replace(",", ";")
COMMAS = "save the file with commas between columns"
SEPARATED = f"row 1: the columns are separated by ';'; {COMMAS}"
UNNAMED, MISSING = "row 1: must name the columns", "row 1: column angle is missing"
CAPITAL = f"{MISSING}; there is 'Angle': rename it"
QUOTED = "\n".join([HEADER, *('"' + line.replace(",", '","').replace(".", ",") + '"' for line in LINES)])
PARQUET = pd.DataFrame({"id": ["a"]}).to_parquet()


def mat() -> bytes:
    savemat(buffer := io.BytesIO(), run())
    return buffer.getvalue()


def zipped(name: str) -> bytes:
    with zipfile.ZipFile(buffer := io.BytesIO(), "w") as archive:
        archive.writestr(name, TEXT)
    return buffer.getvalue()


LOGS: dict[str, tuple[str | bytes, ...]] = {
    "semicolons": (SEMICOLONS, SEPARATED),
    "tabs": (TEXT.replace(",", "\t"), f"row 1: the columns are separated by tabs; {COMMAS}"),
    "spaces": (TEXT.replace(",", " "), f"row 1: the columns are separated by spaces; {COMMAS}"),
    "semicolons and decimal commas": (SEMICOLONS.replace(".", ","), f"{SEPARATED} and decimal points"),
    "semicolons and another name": (SEMICOLONS.replace("angle", "Angle"), SEPARATED, CAPITAL),
    "the line for Excel": ("sep=;\n" + SEMICOLONS, f"{UNNAMED}; row 2 does: delete row 1; {COMMAS}"),
    "decimal commas": (
        TEXT.replace("0.", "0,"),
        "row 2: must have 4 columns like row 1, got 6; if these are decimal commas, write decimal points",
    ),
    "quoted decimal commas": (
        QUOTED,
        *(
            f"row 2: column {name}: '{found}' {NUMBER} below 1e+100: write {found.replace(',', '.')} "
            "(the first of 400 such rows)"
            for name, found in (("t", "0,0"), ("voltage", "7,0"), ("angle", "0,0"))
        ),
    ),
    "a comment above": ("# rig 3\n" + TEXT, f"{UNNAMED}; row 2 does: delete row 1"),
    "comments above": ("# rig 3, north\n# by A, B\n" + TEXT, f"{UNNAMED}; row 3 does: delete rows 1 to 2"),
    "blank rows above": ("\n\n" + TEXT, f"{UNNAMED}; row 3 does: delete rows 1 to 2"),
    "a comment in between": (
        "\n".join([HEADER, *LINES[:9], "# paused", *LINES[9:]]),
        "row 11: must have 4 columns like row 1, got 1; it is a comment: delete it",
    ),
    "units": (
        "\n".join([HEADER, "s,rad,rad/s,V", *LINES]),
        "row 2: must hold numbers, got 's', 'V', 'rad': delete the row",
    ),
    "a header that is a comment": ("# " + TEXT, "row 1: column t is missing; there is '# t': rename it"),
    "capitals": (TEXT.replace("angle", "Angle"), CAPITAL),
    "long names with units": (
        TEXT.replace("t,angle", "Time [s],angle (rad)"),
        "row 1: column t is missing; there is 'Time [s]': rename it",
        f"{MISSING}; there is 'angle (rad)': rename it",
    ),
    "renamed": (TEXT.replace("angle", "phi"), f"{MISSING}; the header has 't', 'phi', 'speed', 'voltage'"),
    "no header": (
        "\n".join(LINES),
        "row 1: must name the columns, 't', 'voltage', 'angle'; it holds numbers: write the names above it",
    ),
    "gzip": (gzip.compress(TEXT.encode()), "is a gzip file, not a CSV table: unpack it with gunzip"),
    "zip": (zipped("b.csv"), "is a zip archive, not a CSV table: unpack it"),
    "xlsx": (zipped("[Content_Types].xml"), "is an Excel file, not a CSV table: save it as CSV"),
    "mat": (mat(), "is a MAT file, not a CSV table: save it as CSV, in MATLAB with writetable"),
    "HDF5 that breaks off": (
        b"\x89HDF\r\n\x1a\n",
        "not an HDF5 file, or damaged (Unable to synchronously open file (bad byte number in an address))",
    ),
    "UTF-16": (TEXT.encode("utf-16"), "is UTF-16 text, not a CSV table: save it as UTF-8"),
    "Latin-1": (
        "\n".join([HEADER, *LINES[:3], "0,0,µ,0"]).encode("latin-1"),
        "not a table: row 5: byte 0xb5 is not UTF-8 text: save the file as UTF-8",
    ),
}


def faults(folder: Path) -> list[str]:
    return refusals(lambda: read_logs(folder, motor()))


@pytest.mark.parametrize("name", LOGS)
def test_a_log_of_another_program(name: str, folder: Path) -> None:
    content, *expected = LOGS[name]
    text(content)(folder)
    lines = [line.replace("b.csv: is", "b.csv is") for line in faults(folder)]
    assert lines == [f"{folder / 'b.csv'}: {line}".replace("b.csv: is", "b.csv is") for line in expected]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (table("id;file;m\na;a.csv;0,5\n"), f"row 1: the columns are separated by ';'; {COMMAS} and decimal"),
        (table("# list\nid,file,m\na,a.csv,1\n"), "row 1: must name the columns; row 2 does: delete row 1"),
        (table("ID,file,m\na,a.csv,1\n"), "row 1: column id is missing; there is 'ID': rename it"),
        (table("id,file,M\na,a.csv,1\n"), "row 1: column m is missing; there is 'M': rename it"),
        (table("id,file,m\nb,B.csv,1\n"), "row 2: column file: 'B.csv': no such file; there is 'b.csv'"),
        (table(PARQUET), "is a Parquet file, not a CSV table: save it as CSV"),
        (table(b"\x89HDF\r\n\x1a\n"), "is an HDF5 file, not a CSV table: give it as logs=<file>"),
        (rename("experiments.csv", "Experiments.csv"), "no such file; there is 'Experiments.csv': rename it"),
        (rename("experiments.csv", "list"), "no such file; write one with a row (id, file) per log"),
    ],
)
def test_a_list_of_experiments_as_others_write_it(change: Change, expected: str, folder: Path) -> None:
    change(folder)
    (line,) = faults(folder)
    assert line.startswith(f"{folder / TABLE}: {expected}")


def test_an_archive_in_place_of_the_folder(tmp_path: Path) -> None:
    path = tmp_path / "logs.zip"
    path.write_bytes(zipped("experiments.csv"))
    wanted = "a folder with experiments.csv and the logs"
    assert faults(path) == [f"{path}: is a zip archive, not {wanted}: unpack it"]
    path.write_text("id,file\n")
    assert faults(path) == [f"{path}: is a file, not {wanted}"]


def test_all_faults_of_a_folder_are_told_at_once(folder: Path) -> None:
    rows, back = [HEADER, *LINES], [HEADER, *LINES]
    rows[9], rows[11] = "0.016,abc,1,nan", "0.02,abc,1,6"
    back[9], back[10] = back[10], back[9]
    (folder / "a.csv").write_text("\n".join(rows))
    (folder / "b.csv").write_text("\n".join(back))
    (folder / "d.mat").write_bytes(mat())
    (folder / "provenance.json").write_text("{}")
    (folder / TABLE).write_text("id,file,m\na,a.csv,x\na,b.csv,0.5\nc,c.csv,\n,d.mat,1\n")
    number = f"{NUMBER} below 1e+100"
    assert [line.removeprefix(f"{folder}/") for line in faults(folder)] == [
        "experiments.csv: row 3: column id: 'a' stands in row 2 already",
        "experiments.csv: row 5: column id: is empty",
        f"experiments.csv: row 2: column m: 'x' {number} (the first of 2 such rows)",
        f"a.csv: row 10: column voltage: 'nan' {number}",
        f"a.csv: row 10: column angle: 'abc' {number} (the first of 2 such rows)",
        "b.csv: row 11: column t: time must increase, 0.016 s follows 0.018 s",
        "experiments.csv: row 4: column file: 'c.csv': no such file",
        "d.mat: is a MAT file, not a CSV table: save it as CSV, in MATLAB with writetable",
        "provenance.json: data is missing",
    ]


TIMES = np.arange(0.0, 2.0, 0.01)
WAVE = np.sin(5.0 * TIMES)
REST = np.full_like(TIMES, 0.4)
Column = Array


def resting(folder: Path, *runs: dict[str, Column]) -> Logs:
    """Logs of the double pendulum with the given columns in place of waves."""
    waves = {"t": TIMES, "tau_one": 2.0 * WAVE, "tau_two": WAVE, "one": 0.3 * WAVE, "two": WAVE}
    known = system_of(folder, DOUBLE, name="double.urdf")
    return logs_of(known, folder / "logs", [waves | columns for columns in runs])


def refused(folder: Path, *runs: dict[str, Column]) -> str:
    return "\n".join(refusals(lambda: resting(folder, *runs))).replace(f"{folder}/logs/", "")


def test_a_joint_that_rests_while_others_move_is_no_dead_output(tmp_path: Path) -> None:
    """The torque that holds it against the other joint changes, but less than one that moves it."""
    found = resting(tmp_path, {}, {"two": REST, "tau_two": 0.3 * WAVE}, {"one": REST, "tau_one": 0.0 * TIMES})
    assert [*found.experiments["id"]] == ["run0", "run1", "run2"]


def test_a_sensor_that_stands_still_while_its_drive_moves_is_dead(tmp_path: Path) -> None:
    dead = "run1.csv: row 2: column two: dead output, 0.4 in every row while its drive moves"
    assert refused(tmp_path, {}, {"two": REST}, {}) == f"{dead}: leave the experiment out"


def test_a_joint_that_never_moves_is_to_be_locked(tmp_path: Path) -> None:
    message = refused(tmp_path, *[{"two": REST, "tau_two": 0.1 * WAVE}] * 2)
    assert message.count("dead output") == 2
    dead = "run0.csv: row 2: column two: dead output, 0.4 in every row"
    assert f"{dead}: lock the joint (locked: {{two: 0.4}})" in message


def test_parts_of_a_log_with_gaps_stay_in_which_a_joint_rests(tmp_path: Path) -> None:
    """A part in which the drive of a resting joint moves is left out: its sensor is dead there."""
    # two swings in every part of 50 samples
    part, swing = np.arange(len(TIMES)) // 50, np.sin(4.0 * np.pi * TIMES)
    held = {"two": 0.4 + np.where(part % 2 == 1, 0.0, swing), "tau_two": np.where(part == 1, 0.0, swing)}
    found = resting(tmp_path, held | {"t": TIMES + part}, {})
    assert found.ids == ("run0.part1", "run0.part2", "run0.part3", "run1")
    np.testing.assert_allclose(found.y[found.rows(1), 1], 0.4)
