"""Bad logs: one clear line that names file, row and column."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.recordings.rawlogs import RawLogs, parse, validate
from tests.conftest import log_text, write_archive
from unmodelled.base.errors import BadInput

Rows = list[list[str]]


def text(rows: Rows) -> bytes:
    return ("\n".join(",".join(row) for row in rows) + "\n").encode()


def checked(rows: Rows) -> np.ndarray:
    return validate(parse(text(rows), "exp7.csv"), "exp7.csv")


def test_a_good_log_round_trips() -> None:
    rows = log_text()
    np.testing.assert_array_equal(checked(rows), np.array(rows, dtype=float))


def set_cell(row: int, column: int, value: str) -> Callable[[Rows], None]:
    def change(rows: Rows) -> None:
        rows[row][column] = value

    return change


def stretch(factor: float) -> Callable[[Rows], None]:
    def change(rows: Rows) -> None:
        rows[0] = [f"{float(x) * factor:.5g}" for x in rows[0]]

    return change


def gap(rows: Rows) -> None:
    rows[0][100:] = [f"{float(x) + 0.01:.5g}" for x in rows[0][100:]]


def dead(row: int) -> Callable[[Rows], None]:
    def change(rows: Rows) -> None:
        rows[row] = ["0.5"] * len(rows[row])

    return change


def shorten(rows: Rows) -> None:
    rows[:] = [row[:20] for row in rows]


BAD: list[tuple[Callable[[Rows], None], str]] = [
    (set_cell(2, 4, "abc"), r"row 3 \(omega\) column 5: 'abc' is not a number"),
    (set_cell(2, 4, ""), r"row 3 \(omega\) column 5: '' is not a number"),
    (set_cell(5, 0, "1.2.3"), r"row 6 \(h\) column 1"),
    (set_cell(6, 9, "nan"), r"row 7 \(eps\) column 10: not a finite number"),
    (set_cell(1, 3, "inf"), r"row 2 \(theta\) column 4: not a finite number"),
    (set_cell(3, 3, "1e999"), r"row 4 \(alpha\) column 4"),
    (set_cell(3, 3, "0x1F"), r"row 4 \(alpha\) column 4"),
    (lambda rows: rows[4].pop(), r"row 5 \(y\): must have 200 columns like row 1, got 199"),
    (lambda rows: rows[0].append("0.1"), r"row 2 \(theta\): must have 201 columns"),
    (lambda rows: rows.pop(), "must have 7 rows"),
    (lambda rows: rows.append(rows[0]), "must have 7 rows"),
    (lambda rows: rows.clear(), "must have 7 rows"),
    (set_cell(0, 50, "0.001"), r"row 1 \(t\) column 51: time must increase"),
    (stretch(2.0), r"sampling period must be 0.0005 s within 1 %, got 0.001 s"),
    (stretch(1.03), "sampling period must be"),
    (gap, r"row 1 \(t\) column 101: time is not uniform"),
    (dead(1), r"row 2 \(theta\): dead sensor"),
    (dead(4), r"row 5 \(y\): dead sensor"),
    (shorten, "must have at least 50 columns, got 20"),
]


@pytest.mark.parametrize(("change", "message"), BAD, ids=[m for _, m in BAD])
def test_bad_log(change: Callable[[Rows], object], message: str) -> None:
    rows = log_text()
    change(rows)
    with pytest.raises(BadInput, match=message) as caught:
        checked(rows)
    assert str(caught.value).startswith("exp7.csv: ")
    assert "\n" not in str(caught.value)


def test_time_stamps_rounded_to_five_digits_may_repeat_beyond_ten_seconds() -> None:
    rows = log_text(n=24_000)
    rows[0] = [f"{i * 0.0005:.5g}" for i in range(24_000)]
    assert checked(rows).shape == (7, 24_000)


PARAMETERS: list[tuple[str, str]] = [
    ("exp,H,beta,m\n1,0.03,3.14,1.1\n", "column V is missing"),
    ("exp,H,beta,m,V\n1,0.03,3.14,1.1,5\n1,0.03,3.14,1.1,6\n", "row 3: column exp: experiment 1 twice"),
    ("exp,H,beta,m,V\n1,0.03,3.14,heavy,5\n", "row 2: column m: 'heavy' is not a finite number"),
    ("exp,H,beta,m,V\n1,0.03,3.14,1.1,\n", "row 2: column V: '' is not a finite number"),
    ("exp,H,beta,m,V\n1,0.03,3.14,1.1,5\n9,0.03,3.14,1.1,5\n", "exp9.csv is missing"),
    ("exp,H,beta,m,V\n", "no rows below it"),
    ("", "not a table"),
]


@pytest.mark.parametrize(("table", "message"), PARAMETERS, ids=[m for _, m in PARAMETERS])
def test_bad_parameters(tmp_path: Path, table: str, message: str) -> None:
    path = write_archive(tmp_path / "campaign.zip", {1: log_text()}, table)
    with pytest.raises(BadInput, match=message):
        RawLogs(path).parameters()


def test_a_log_that_parameters_do_not_list(tmp_path: Path) -> None:
    table = "exp,H,beta,m,V\n1,0.03,3.14,1.1,5\n"
    path = write_archive(tmp_path / "campaign.zip", {1: log_text(), 2: log_text()}, table)
    with pytest.raises(BadInput, match="experiment 2 is missing"):
        RawLogs(path).parameters()


@pytest.mark.parametrize(
    ("content", "message"), [(None, "no such file"), (b"", "not a zip"), (b"PK\x03\x04 torn", "not a zip")]
)
def test_bad_archive(tmp_path: Path, content: bytes | None, message: str) -> None:
    path = tmp_path / "campaign.zip"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BadInput, match=message):
        RawLogs(path)


def test_truncated_archive(tmp_path: Path) -> None:
    whole = write_archive(tmp_path / "whole.zip", {1: log_text()}).read_bytes()
    torn = tmp_path / "torn.zip"
    torn.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(BadInput, match=r"torn\.zip"):
        RawLogs(torn)
