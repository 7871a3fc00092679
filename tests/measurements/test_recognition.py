"""Tables as other programs write them: what is said of each, and what to do."""

from __future__ import annotations

import gzip
import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from scipy.io import savemat

from tests.measurements.systems import motor, run, write_folder
from unmodelled.base.errors import BadInput
from unmodelled.logs.folder import read_logs

TEXT = pd.DataFrame(run()).round(6).to_csv(index=False)
HEADER, *LINES = TEXT.splitlines()
SEMICOLONS = TEXT.replace(",", ";")
COMMAS = "save the file with commas between columns"
QUOTED = "\n".join([HEADER, *('"' + line.replace(",", '","').replace(".", ",") + '"' for line in LINES)])


def mat() -> bytes:
    buffer = io.BytesIO()
    savemat(buffer, run())
    return buffer.getvalue()


def zipped(name: str) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(name, TEXT)
    return buffer.getvalue()


def parquet() -> bytes:
    buffer = io.BytesIO()
    pd.DataFrame({"id": ["a"], "file": ["a.csv"]}).to_parquet(buffer)
    return buffer.getvalue()


LOGS: dict[str, tuple[str | bytes, list[str]]] = {
    "semicolons": (SEMICOLONS, [f"row 1: the columns are separated by ';'; {COMMAS}"]),
    "tabs": (TEXT.replace(",", "\t"), [f"row 1: the columns are separated by tabs; {COMMAS}"]),
    "spaces": (TEXT.replace(",", " "), [f"row 1: the columns are separated by spaces; {COMMAS}"]),
    "semicolons and decimal commas": (
        SEMICOLONS.replace(".", ","),
        [f"row 1: the columns are separated by ';'; {COMMAS} and decimal points"],
    ),
    "semicolons and another name": (
        SEMICOLONS.replace("angle", "Angle"),
        [
            f"row 1: the columns are separated by ';'; {COMMAS}",
            "row 1: column angle is missing; there is 'Angle': rename it",
        ],
    ),
    "the line by which Excel knows": (
        "sep=;\n" + SEMICOLONS,
        [f"row 1: must name the columns; row 2 does: delete row 1; {COMMAS}"],
    ),
    "decimal commas": (
        TEXT.replace("0.", "0,"),
        ["row 2: must have 4 columns like row 1, got 6; if these are decimal commas, write decimal points"],
    ),
    "quoted decimal commas": (
        QUOTED,
        [
            f"row 2: column {name}: '{found}' is not a finite number below 1e+100: write "
            f"{found.replace(',', '.')} (the first of 400 such rows)"
            for name, found in (("t", "0,0"), ("voltage", "7,0"), ("angle", "0,0"))
        ],
    ),
    "a comment above": ("# rig 3\n" + TEXT, ["row 1: must name the columns; row 2 does: delete row 1"]),
    "comments with commas above": (
        "# rig 3, north\n# by A, B\n" + TEXT,
        ["row 1: must name the columns; row 3 does: delete rows 1 to 2"],
    ),
    "blank rows above": ("\n\n" + TEXT, ["row 1: must name the columns; row 3 does: delete rows 1 to 2"]),
    "a comment in between": (
        "\n".join([HEADER, *LINES[:9], "# paused", *LINES[9:]]),
        ["row 11: must have 4 columns like row 1, got 1; it is a comment: delete it"],
    ),
    "units": (
        "\n".join([HEADER, "s,rad,rad/s,V", *LINES]),
        ["row 2: must hold numbers, got 's', 'V', 'rad': delete the row"],
    ),
    "a header that is a comment": ("# " + TEXT, ["row 1: column t is missing; there is '# t': rename it"]),
    "capitals": (
        TEXT.replace("angle", "Angle"),
        ["row 1: column angle is missing; there is 'Angle': rename it"],
    ),
    "long names with units": (
        TEXT.replace("t,angle", "Time [s],angle (rad)"),
        [
            "row 1: column t is missing; there is 'Time [s]': rename it",
            "row 1: column angle is missing; there is 'angle (rad)': rename it",
        ],
    ),
    "other names": (
        TEXT.replace("angle", "phi"),
        ["row 1: column angle is missing; the header has 't', 'phi', 'speed', 'voltage'"],
    ),
    "no header": (
        "\n".join(LINES),
        ["row 1: must name the columns, 't', 'voltage', 'angle'; it holds numbers: write the names above it"],
    ),
    "gzip": (gzip.compress(TEXT.encode()), ["is a gzip file, not a CSV table: unpack it with gunzip"]),
    "zip": (zipped("b.csv"), ["is a zip archive, not a CSV table: unpack it"]),
    "xlsx": (zipped("[Content_Types].xml"), ["is an Excel file, not a CSV table: save it as CSV"]),
    "mat": (mat(), ["is a MAT file, not a CSV table: save it as CSV, in MATLAB with writetable"]),
    "HDF5 that breaks off": (
        b"\x89HDF\r\n\x1a\n",
        ["not an HDF5 file, or damaged (Unable to synchronously open file (bad byte number in an address))"],
    ),
    "UTF-16": (TEXT.encode("utf-16"), ["is UTF-16 text, not a CSV table: save it as UTF-8"]),
    "Latin-1": (
        "\n".join([HEADER, *LINES[:3], "0,0,µ,0"]).encode("latin-1"),
        ["not a table: row 5: byte 0xb5 is not UTF-8 text: save the file as UTF-8"],
    ),
}


def faults(folder: Path) -> list[str]:
    with pytest.raises(BadInput) as refused:
        read_logs(folder, motor())
    return [str(refused.value), *refused.value.others]


@pytest.mark.parametrize("name", LOGS)
def test_a_log_of_another_program(name: str, tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "logs", {"a": run(), "b": run()})
    content, expected = LOGS[name]
    (folder / "b.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    lines = [line.replace("b.csv: is", "b.csv is") for line in faults(folder)]
    assert lines == [f"{folder / 'b.csv'}: {line}".replace("b.csv: is", "b.csv is") for line in expected]


def rename(old: str, new: str) -> Callable[[Path], object]:
    return lambda folder: (folder / old).rename(folder / new)


def table(content: str | bytes) -> Callable[[Path], object]:
    data = content if isinstance(content, bytes) else content.encode()
    return lambda folder: (folder / "experiments.csv").write_bytes(data)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (table("id;file;m\na;a.csv;0,5\n"), f"row 1: the columns are separated by ';'; {COMMAS} and decimal"),
        (table("# list\nid,file,m\na,a.csv,1\n"), "row 1: must name the columns; row 2 does: delete row 1"),
        (table("ID,file,m\na,a.csv,1\n"), "row 1: column id is missing; there is 'ID': rename it"),
        (table("id,file,M\na,a.csv,1\n"), "row 1: column m is missing; there is 'M': rename it"),
        (table("id,file,m\nb,B.csv,1\n"), "row 2: column file: 'B.csv': no such file; there is 'b.csv'"),
        (table(parquet()), "is a Parquet file, not a CSV table: save it as CSV"),
        (table(b"\x89HDF\r\n\x1a\n"), "is an HDF5 file, not a CSV table: give it as logs=<file>"),
        (rename("experiments.csv", "Experiments.csv"), "no such file; there is 'Experiments.csv': rename it"),
        (rename("experiments.csv", "list"), "no such file; write one with a row (id, file) per log"),
    ],
)
def test_a_list_of_experiments_as_others_write_it(
    change: Callable[[Path], object], expected: str, tmp_path: Path
) -> None:
    folder = write_folder(tmp_path / "logs", {"a": run(), "b": run()})
    change(folder)
    (line,) = faults(folder)
    assert line.startswith(f"{folder / 'experiments.csv'}: {expected}")


def test_an_archive_in_place_of_the_folder(tmp_path: Path) -> None:
    path = tmp_path / "logs.zip"
    path.write_bytes(zipped("experiments.csv"))
    wanted = "a folder with experiments.csv and the logs"
    assert faults(path) == [f"{path}: is a zip archive, not {wanted}: unpack it"]
    path.write_text("id,file\n")
    assert faults(path) == [f"{path}: is a file, not {wanted}"]


def test_all_faults_of_a_folder_are_told_at_once(tmp_path: Path) -> None:
    good = run()
    folder = write_folder(tmp_path, {"a": good, "b": good})
    rows = [HEADER, *LINES]
    rows[9] = "0.016,abc,1,nan"
    rows[11] = "0.02,abc,1,6"
    (folder / "a.csv").write_text("\n".join(rows))
    back = [HEADER, *LINES]
    back[9], back[10] = back[10], back[9]
    (folder / "b.csv").write_text("\n".join(back))
    (folder / "d.mat").write_bytes(mat())
    (folder / "provenance.json").write_text("{}")
    (folder / "experiments.csv").write_text("id,file,m\na,a.csv,x\na,b.csv,0.5\nc,c.csv,\n,d.mat,1\n")
    number = "is not a finite number below 1e+100"
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
