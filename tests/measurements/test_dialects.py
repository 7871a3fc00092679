"""Text tables as recorders write them: the same numbers from every dialect."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from unmodelled.base.errors import BadInput, Faults
from unmodelled.logs.readers.known import read_files
from unmodelled.logs.readers.reader import Table

T = np.arange(60) * 0.25
X = np.round(np.sin(T), 6)
ROWS = [f"{t},{x}" for t, x in zip(T, X, strict=True)]
BODY = "\n".join(ROWS) + "\n"


def table(path: Path, content: str | bytes) -> Table:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    faults = Faults()
    found = read_files([path], None, faults)
    faults.check()
    (only,) = found[path]
    return only


def commas(text: str) -> str:
    return text.replace(",", ";").replace(".", ",")


@pytest.mark.parametrize(
    ("content", "names", "units", "first"),
    [
        ("t,x\n" + BODY, ["t", "x"], {}, 2),
        ("t;x\n" + BODY.replace(",", ";"), ["t", "x"], {}, 2),
        ("t\tx\n" + BODY.replace(",", "\t"), ["t", "x"], {}, 2),
        ("t|x\n" + BODY.replace(",", "|"), ["t", "x"], {}, 2),
        ("t   x\n" + BODY.replace(",", "   "), ["t", "x"], {}, 2),
        ("t;x\n" + commas(BODY), ["t", "x"], {}, 2),
        ("t\tx\n" + BODY.replace(",", "\t").replace(".", ","), ["t", "x"], {}, 2),
        (BODY, ["1", "2"], {}, 1),
        (commas(BODY), ["1", "2"], {}, 1),
        ("\ufefft,x\r\n" + BODY.replace("\n", "\r\n"), ["t", "x"], {}, 2),
        ("# bench 3\n# 25.11.2026, noon\n\nt, x\n" + BODY, ["t", "x"], {}, 5),
        ("# t x\n" + BODY.replace(",", " "), ["t", "x"], {}, 2),
        (
            "Recorder;3.1\nUser;Anna\nRate;4;Hz\n\nt;x\ns;mm\n" + BODY.replace(",", ";"),
            ["t", "x"],
            {"t": "s", "x": "mm"},
            7,
        ),
        ("t,x\n[s],[rad]\n" + BODY, ["t", "x"], {"t": "s", "x": "rad"}, 3),
        ("t [s],x (deg)\n" + BODY, ["t [s]", "x (deg)"], {"t [s]": "s", "x (deg)": "deg"}, 2),
        ('"t","x"\n' + "\n".join(f'"{t}","{x}"' for t, x in zip(T, X, strict=True)), ["t", "x"], {}, 2),
        ("x,x\n" + BODY, ["x", "x#2"], {}, 2),
        ("t,\n" + BODY, ["t", "2"], {}, 2),
        ("t,x\n" + BODY.replace("e", "d"), ["t", "x"], {}, 2),
    ],
)
def test_dialects(tmp_path: Path, content: str, names: list[str], units: dict[str, str], first: int) -> None:
    found = table(tmp_path / "a.csv", content)
    assert list(found.columns) == names and found.units == units and found.first == first
    np.testing.assert_allclose(list(found.columns.values()), [T, X])


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1", "utf-8-sig"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    found = table(tmp_path / "a.csv", ("t [s],x [°]\n" + BODY).encode(encoding))
    assert found.units == {"t [s]": "s", "x [°]": "°"} and found.aliases == {"t": "t [s]", "x": "x [°]"}
    np.testing.assert_allclose(found.columns["x [°]"], X)


@pytest.mark.parametrize(
    ("cells", "separator"),
    [
        ([f"2026-11-25T10:00:{t:09.6f}Z" for t in T], ","),
        ([f"2026-11-25 10:00:{t:06.3f}" for t in T], ","),
        ([f"2026-11-25 10:00:{t:06.3f}+01:00" for t in T], ","),
        ([f"10:00:{t:06.3f}" for t in T], ","),
        ([f"25.11.2026 10:00:{t:06.3f}" for t in T], ";"),
        ([f"25.11.2026 10:00:{t:06.3f}".replace(".", ",").replace("25,11,", "25.11.") for t in T], ";"),
    ],
)
def test_dates_and_times_of_day_are_seconds(tmp_path: Path, cells: list[str], separator: str) -> None:
    rows = [f"{cell}{separator}{x}" for cell, x in zip(cells, X, strict=True)]
    found = table(tmp_path / "a.csv", f"time{separator}x\n" + "\n".join(rows))
    np.testing.assert_allclose(found.columns["time"], T, atol=1e-9)
    assert found.units["time"] == "s"


@pytest.mark.parametrize(
    "pattern",
    [
        "%m/%d/%Y %I:%M:%S.%f %p",
        "%d/%m/%Y %H:%M:%S.%f",
        "%Y/%m/%d %H:%M:%S.%f",
        "%d-%b-%Y %H:%M:%S.%f",
        "days",
    ],
)
def test_dates_of_other_orders_and_durations_are_seconds(tmp_path: Path, pattern: str) -> None:
    """Over midnight, where day and month must not change places."""
    clock = [pd.Timestamp("2026-03-04T23:59:53") + pd.Timedelta(t, "s") for t in T]
    cells = [
        str(pd.Timedelta(86_395.25 + t, "s")) if pattern == "days" else each.strftime(pattern)
        for t, each in zip(T, clock, strict=True)
    ]
    rows = [f"{cell},{x}" for cell, x in zip(cells, X, strict=True)]
    found = table(tmp_path / "a.csv", "stamp,x\n" + "\n".join(rows))
    np.testing.assert_allclose(found.columns["stamp"], T, atol=1e-9)


def test_times_of_day_go_on_over_midnight(tmp_path: Path) -> None:
    clock = [np.datetime64("2026-11-25T23:59:52.00") + np.timedelta64(round(1e3 * t), "ms") for t in T]
    rows = [f"{str(each)[11:]},{x}" for each, x in zip(clock, X, strict=True)]
    rows[9] = f",{X[9]}"
    found = table(tmp_path / "a.csv", "time,x\n" + "\n".join(rows)).columns["time"]
    steps = np.diff(np.delete(found, 9))
    np.testing.assert_allclose(steps, np.diff(np.delete(T, 9)), atol=1e-9)


def test_lists_in_cells_words_truths_and_empty_cells(tmp_path: Path) -> None:
    rows = [
        f'STATE,{t},"[{x}, {-x}]",{"true" if t < 1 else "false"},{"" if t < 1 else x}'
        for t, x in zip(T, X, strict=True)
    ]
    found = table(tmp_path / "a.csv", "type,stamp,q,on,load\n" + "\n".join(rows))
    assert list(found.columns) == ["stamp", "q[0]", "q[1]", "on", "load"] and not found.aliases
    np.testing.assert_allclose(found.columns["q[1]"], -X)
    assert found.columns["on"].tolist() == (T < 1).astype(float).tolist()
    assert np.isnan(found.columns["load"][:4]).all() and found.columns["load"][4] == X[4]
    assert list(found.texts["type"]) == ["STATE"] * 60


@pytest.mark.parametrize("cell", ["[{x}, {y}]", "[{x} {y}]", "[ {x};{y} ]", "[{x}, nan]"])
def test_lists_of_any_separator(tmp_path: Path, cell: str) -> None:
    cells = [cell.format(x=x, y=2.0 * x) for x in X]
    cells[5] = ""
    rows = [f'{t},"{each}"' for t, each in zip(T, cells, strict=True)]
    found = table(tmp_path / "a.csv", "t,q\n" + "\n".join(rows)).columns
    second = np.full(60, np.nan) if "nan" in cell else 2.0 * X
    for name, expected in (("q[0]", X), ("q[1]", second)):
        np.testing.assert_array_equal(np.delete(found[name], 5), np.delete(expected, 5))
        assert np.isnan(found[name][5])


def test_a_word_in_a_column_of_numbers_is_an_empty_cell(tmp_path: Path) -> None:
    found = table(tmp_path / "a.csv", "t,x\n" + BODY.replace(ROWS[30], "7.5,overflow"))
    assert np.isnan(found.columns["x"][30]) and np.isfinite(np.delete(found.columns["x"], 30)).all()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("t,x\n", "row 1: no row of numbers was found"),
        ("\n\n", "row 1: no row of numbers was found"),
        ("hello world\n" * 20, "row 1: no row of numbers was found"),
        ("t,x\n" + BODY + "1,2,3\n", "row 62: must have 2 columns, got 3"),
        (b"\x00\x01\x02" * 100, "is not of a format that is read"),
        (b"\xd0\xcf\x11\xe0" + bytes(99), "is an Excel file"),
        (b"", "is not of a format that is read"),
    ],
)
def test_text_that_is_no_table(tmp_path: Path, content: str | bytes, message: str) -> None:
    with pytest.raises(BadInput) as caught:
        table(tmp_path / "a.csv", content)
    assert message in str(caught.value) and str(caught.value).startswith(f"{tmp_path}/a.csv: ")
