"""What must never get through: every kind of input that is known to be wrong, hostile or both."""

from __future__ import annotations

import io
import pickle
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import torch

from tests.fuzz.inputs import Case, complaint

Change = Callable[[bytes], bytes]


def put(old: str, new: str | bytes) -> Change:
    def change(content: bytes) -> bytes:
        assert content.count(old.encode()) >= 1, old
        return content.replace(old.encode(), new if isinstance(new, bytes) else new.encode(), 1)

    return change


def whole(content: bytes | str) -> Change:
    return lambda _: content if isinstance(content, bytes) else content.encode()


def row(number: int, *cells: str) -> Change:
    def change(content: bytes) -> bytes:
        lines = content.decode().splitlines()
        lines[number - 1] = ",".join(cells)
        return "\n".join(lines).encode()

    return change


def doubled(number: int) -> Change:
    def change(content: bytes) -> bytes:
        lines = content.decode().splitlines()
        return "\n".join([*lines[:number], *lines[number - 1 :]]).encode()

    return change


def utf16(content: bytes) -> bytes:
    return content.decode().encode("utf-16")


LAUGHS = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{b}: &{b} [{','.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
MASS = "  M:  {value: 8.5"
RATE = "  v: (F_m - b*v - F_rail)/M - 9.81"
EXPRESSIONS = [
    *("9**9**9**9", "x**9**9**9", "2**(10**9)", "exp(exp(exp(99999)))*F_rail", "F_rail/0", "F_rail + x"),
    *("F_rail + __import__('os').system('touch hacked')", "F_rail.__class__", "[F_rail][0]", "F_rail = 1"),
    *("(lambda: F_rail)()", "eval('F_rail')", "F_rail if x else 0", "f'{F_rail}'", "F_rail := 1"),
    *("(" * 200 + "F_rail" + ")" * 200, "-" * 5000 + "F_rail", "+".join(["F_rail"] * 5000), "F_rail; x"),
    *("log(-1)*F_rail", "sqrt(-1) + F_rail", "open('hacked', 'w')", "x and F_rail", "F_rail, x", "'F_rail'"),
]
SYSTEMS: list[Change] = [
    whole(""),
    whole(b"\0" * 100),
    whole(LAUGHS),
    whole("[" * 100_000),
    whole("a: " * 50_000),
    whole("!!python/object/apply:os.system [touch hacked]"),
    utf16,
    lambda content: content[:400],
    lambda content: content + content,
    lambda content: content + b"\nunknown: 1\n",
    lambda content: content + b"\0",
    put("schema: system/1", "schema: system/2"),
    put("schema: system/1\n", ""),
    put("name: hoist", "name: !!python/name:os.system"),
    put("name: hoist", "name: &hoist hoist"),
    put("name: hoist", "name: ../hoist"),
    put("parameters:", "parametres:"),
    *(
        put(MASS, f"  M:  {{value: {v}")
        for v in ("nan", ".inf", "-.inf", "1e999", "9" * 5000, "heavy", "''", "[1]")
    ),
    *(put(MASS, f"  M:  {{value: {v}") for v in ("8,5", "0x1F", "1_0", "{}", "true", "null", "1:30", "8.5e")),
    put("M:  {value: 8.5, unit: kg}", "M:  {value: 8.5, unit: mm}"),
    put("M:  {value: 8.5, unit: kg}", "M:  {value: 8.5, unit: s}"),
    put("M:  {value: 8.5, unit: kg}", "M:  {value: 8.5, unit: kg, unit: kg}"),
    put("M:  {value: 8.5, unit: kg}", "M:  {value: 8.5, unit: kg**999999999}"),
    put("bounds: [5, 90]", "bounds: [90, 5]"),
    put("bounds: [5, 90]", "bounds: [40, 90]"),
    put("  x: v\n", "  x: v\n  x: v\n"),
    put("  x: v\n", ""),
    *(put(RATE, f"  v: {expression}") for expression in EXPRESSIONS),
    put("F_m: kf*u", "F_m: F_m*u"),
    put("file: converter.csv", "file: ../converter.csv"),
    put("file: converter.csv", "file: /etc/passwd"),
    put("kind: cubic", "kind: quintic"),
]
LOGS: dict[str, list[Change]] = {
    "b.csv": [
        *(row(7, cell, "1", "1", "6") for cell in ("nan", "-inf", "1e999", "oops", "", "0.001", "5", "-1")),
        *(row(7, "0.01", cell, "1", "6") for cell in ("NaN", "inf", "1e200", "9" * 400, "1,5", "0x1", "١")),
        row(1, "t", "angle", "speed"),
        row(1, "t", "angle", "angle", "voltage"),
        doubled(9),
        utf16,
        whole(b"\0" * 500),
        whole(b"PAR1" + b"\0" * 500),
        lambda content: content[:700],
        lambda content: content.replace(b",", b";"),
        lambda content: content.replace(b".", b"\0"),
        lambda content: b"\n".join(content.splitlines()[:40]),
        lambda content: b"\n".join(content.splitlines()[:1]),
    ],
    "experiments.csv": [
        row(3, "a", "b.csv", "0.5", "g"),
        row(3, "b", "../b.csv", "0.5", "g"),
        row(3, "b", "/etc/passwd", "0.5", "g"),
        row(3, "b", "c.csv", "0.5", "g"),
        *(row(3, "b", "b.csv", cell, "g") for cell in ("nan", "inf", "", "heavy", "1e999")),
        row(1, "id", "file", "mass", "group"),
        row(1, "id", "file", "m", "m"),
        utf16,
        whole(""),
    ],
    "provenance.json": [whole("{"), whole("[1]"), whole('{"data": "imagined"}'), whole("[" * 100_000)],
}
JSON: list[Change] = [
    utf16,
    lambda content: b"\xef\xbb\xbf" + content,
    lambda content: content[:-5],
    lambda content: content + b"{}",
    lambda content: content + b"\0",
    whole("[" * 100_000 + "]" * 100_000),
    whole("null"),
    whole("9" * 5000),
    put('"confidence": 0.8', '"confidence": NaN'),
    put('"confidence": 0.8', '"confidence": 1e999'),
    put('"confidence": 0.8', '"confidence": "high"'),
    put('"confidence": 0.8', '"confidence": true'),
    put('"verdict": "effect"', '"verdict": "guilty"'),
    put('"floor": 0.01', '"flour": 0.01'),
    put('"effects": [', '"effects": [7, '),
]
CASES = [
    *(("system", "hoist.yaml", change) for change in SYSTEMS),
    *(("logs", file, change) for file, changes in LOGS.items() for change in changes),
    *(("diagnosis", "d.json", change) for change in JSON),
]


@pytest.mark.parametrize(("name", "file", "change"), CASES)
def test_what_is_wrong_is_refused(
    name: str,
    file: str,
    change: Change,
    cases: dict[str, Case],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    folder, case = tmp_path / "input", cases[name]
    case.put(folder)
    (folder / file).write_bytes(change(case.files[file]))
    begin = time.perf_counter()
    assert complaint(case.read, folder, file)
    assert time.perf_counter() - begin < 10.0
    assert [path.name for path in tmp_path.iterdir()] == ["input"]


class Evil:
    """Touches a file when it is unpickled."""

    def __reduce__(self) -> tuple[object, tuple[Path]]:
        return Path.touch, (Path("hacked"),)


def legacy(content: object) -> bytes:
    buffer = io.BytesIO()
    torch.save(content, buffer, _use_new_zipfile_serialization=False)
    return buffer.getvalue()


def saved(content: object) -> bytes:
    buffer = io.BytesIO()
    torch.save(content, buffer)
    return buffer.getvalue()


def flipped(content: bytes) -> bytes:
    """A bit of the weights is another."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        largest = max(archive.infolist(), key=lambda member: member.file_size)
    at = content.index(largest.filename.encode()) + len(largest.filename) + largest.file_size // 2 + 64
    return content[:at] + bytes([content[at] ^ 4]) + content[at + 1 :]


ABOUT = {"class": "Linear", "about": {}}
CHECKPOINTS: list[Change] = [
    whole(saved({**ABOUT, "state": Evil()})),
    whole(legacy({**ABOUT, "state": Evil()})),
    whole(pickle.dumps(Evil())),
    whole(saved({**ABOUT, "state": {}})),
    whole(saved({**ABOUT, "state": {"coefficients": torch.zeros(3)}})),
    whole(saved([1, 2, 3])),
    whole(""),
    whole(b"PK\x03\x04" + bytes(100)),
    flipped,
    lambda content: content[: len(content) // 2],
]


@pytest.mark.parametrize("name", ["linear", "hybrid", "lstm"])
@pytest.mark.parametrize("change", CHECKPOINTS)
def test_a_checkpoint_that_is_none_is_refused(
    name: str, change: Change, cases: dict[str, Case], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    case = cases[name]
    case.put(tmp_path / "fit")
    (tmp_path / "fit" / case.edits[0]).write_bytes(change(case.files[case.edits[0]]))
    assert complaint(case.read, tmp_path / "fit", case.edits[0])
    assert [path.name for path in tmp_path.iterdir()] == ["fit"]


def test_a_store_tells_when_a_bit_of_it_has_changed(cases: dict[str, Case], tmp_path: Path) -> None:
    case = cases["store"]
    content = case.files["signals.parquet"]
    offset = pq.ParquetFile(io.BytesIO(content)).metadata.row_group(0).column(2).data_page_offset
    at = offset + 100
    case.put(tmp_path, signals__parquet=content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
    assert "damaged" in complaint(case.read, tmp_path, "signals.parquet")


def test_a_small_file_cannot_ask_for_all_memory(
    cases: dict[str, Case], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A table and a log that are larger than any that was measured, and small on disk."""
    monkeypatch.setattr("pipeline.parquet.LARGEST", 10**6)
    zeros = np.zeros(10**6)
    buffer = io.BytesIO()
    pq.write_table(pa.table({"t": zeros, "angle": zeros, "voltage": zeros}), buffer, compression="zstd")
    assert len(buffer.getvalue()) < 10**5
    cases["parquet"].put(tmp_path / "table", b__parquet=buffer.getvalue())
    assert "too large" in complaint(cases["parquet"].read, tmp_path / "table", "b.parquet")

    monkeypatch.setattr("pipeline.rawlogs.LARGEST", 10**6)
    log = io.BytesIO()
    with zipfile.ZipFile(log, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("parameters.csv", "exp,H,beta,m,V\n1,0.03,3.14,1.1,5\n")
        archive.writestr("exp1.csv", bytes(10**7))
    assert len(log.getvalue()) < 10**5
    cases["archive"].put(tmp_path / "zip", campaign__zip=log.getvalue())
    assert "too large" in complaint(cases["archive"].read, tmp_path / "zip", "exp1.csv")
