"""What must never get through: input that is hostile, and what only a program would write.

Plain faults are those of tests/physics/system/test_reader.py, tests/physics/system/test_grammar.py,
tests/measurements/test_refusals.py and tests/test_shapes.py.
"""

import io
import os
import pickle
import resource
import time
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import torch
from scipy.io import savemat

from tests.fuzz.inputs import Case, complaint
from tests.fuzz.test_edited_files import NAMES

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
    put("name: hoist", "name: !!python/name:os.system"),
    put("name: hoist", "name: &hoist hoist"),
    put("name: hoist", "name: ../hoist"),
    *(put(MASS, f"  M:  {{value: {value}") for value in ("9" * 5000, "8,5", "0x1F", "1_0", "1:30", "8.5e")),
    *(put(MASS, f"  M:  {{value: {value}") for value in ("''", "{}", "true", "null")),
    put(f"{MASS}, unit: kg", f"{MASS}, unit: kg**999999999"),
    *(put(RATE, f"  v: {expression}") for expression in EXPRESSIONS),
    put("F_m: kf*u", "F_m: F_m*u"),
    put("file: converter.csv", "file: ../converter.csv"),
    put("file: converter.csv", "file: /etc/passwd"),
]
LOGS: dict[str, list[Change]] = {
    "b.csv": [
        *(
            row(7, *cells, "1", "6")
            for cells in (("5", "1"), ("-1", "1"), ("0.01", "9" * 400), ("0.01", "١"))
        ),
        utf16,
        whole(b"\0" * 500),
        lambda content: content[:700],
        whole(b"PK\x03\x04" + bytes(500)),
        whole(b";" * 100_000),
        whole(b"\n" * 100_000 + b"t,angle,voltage\n"),
        lambda content: content.replace(b".", b"\0"),
    ],
    "experiments.csv": [utf16],
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
    *(put('"confidence": 0.8', f'"confidence": {value}') for value in ("NaN", "1e999", '"high"', "true")),
    put('"verdict": "effect"', '"verdict": "guilty"'),
    put('"floor": 0.01', '"flour": 0.01'),
    put('"effects": [', '"effects": [7, '),
]
CASES = [
    *(("system", "hoist.yaml", change) for change in SYSTEMS),
    *(("logs", file, change) for file, changes in LOGS.items() for change in changes),
    *(("diagnosis", "d.json", change) for change in JSON),
]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, in which what is executed would leave a file."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(("name", "file", "change"), CASES)
def test_what_is_wrong_is_refused(
    name: str, file: str, change: Change, cases: dict[str, Case], here: Path
) -> None:
    folder, case = here / "input", cases[name]
    case.put(folder)
    (folder / file).write_bytes(change(case.files[file]))
    begin = time.perf_counter()
    assert complaint(case.read, folder, file)
    assert time.perf_counter() - begin < 10.0
    assert [path.name for path in here.iterdir()] == ["input"]


class Evil:
    """Touches a file when it is unpickled."""

    def __reduce__(self) -> tuple[object, tuple[Path]]:
        return Path.touch, (Path("hacked"),)


def saved(content: object, zipped: bool = True) -> bytes:
    buffer = io.BytesIO()
    torch.save(content, buffer, _use_new_zipfile_serialization=zipped)
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
    whole(saved({**ABOUT, "state": Evil()}, zipped=False)),
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
    name: str, change: Change, cases: dict[str, Case], here: Path
) -> None:
    case, folder = cases[name], here / "fit"
    case.put(folder)
    (folder / case.edits[0]).write_bytes(change(case.files[case.edits[0]]))
    assert complaint(case.read, folder, case.edits[0])
    assert [path.name for path in here.iterdir()] == ["fit"]


def test_a_store_tells_when_a_bit_of_it_has_changed(cases: dict[str, Case], tmp_path: Path) -> None:
    case = cases["store"]
    content = case.files["signals.parquet"]
    offset = pq.ParquetFile(io.BytesIO(content)).metadata.row_group(0).column(2).data_page_offset
    at = offset + 100
    case.put(tmp_path, signals__parquet=content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
    assert "damaged" in complaint(case.read, tmp_path, "signals.parquet")


@pytest.mark.parametrize("name", NAMES)
def test_what_is_no_regular_file_is_not_read(name: str, cases: dict[str, Case], tmp_path: Path) -> None:
    """A pipe into which nobody writes, and a device that gives zeros without end."""
    case = cases[name]
    case.put(tmp_path)
    for file in case.edits:
        path = tmp_path / file
        path.unlink()
        path.symlink_to("/dev/zero")
        line = complaint(case.read, tmp_path, file)
        # a table must lie beside its system file, so that no link out of the folder is followed
        assert "is a device, not a regular file" in line or "must lie in the folder" in line, (file, line)
        path.unlink()
        # as /proc/kmsg, which would be waited for; and a file that has a size, as /sys/kernel/notes
        for kernel in ("/proc/version", "/sys/devices/system/cpu/online"):
            path.symlink_to(kernel)
            line = complaint(case.read, tmp_path, file)  # none of `init`, which leaves such a file out
            told = "is made by the kernel, not a regular file" in line or "must lie in" in line
            assert told or name == "init", (file, line)
            path.unlink()
        os.mkfifo(path)
        assert "is a named pipe, not a regular file" in complaint(case.read, tmp_path, file), file
        path.unlink()
        path.write_bytes(case.files[file])


def packed(columns: Mapping[str, object]) -> bytes:
    buffer = io.BytesIO()
    pq.write_table(pa.table(columns), buffer, compression="zstd")
    return buffer.getvalue()


def bomb_table() -> bytes:
    """Four million rows of numbers in some kB."""
    return packed(dict.fromkeys(("t", "angle", "voltage"), np.zeros(4 * 10**6)))


def bomb_hdf5() -> bytes:
    """Four million zeros a dataset, of which an HDF5 file holds one chunk in some kB."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        group = file.create_group("a")
        group.attrs["m"] = 0.5
        for name in ("t", "angle", "voltage"):
            group.create_dataset(name, shape=(4 * 10**6,), dtype=np.float64, compression="gzip")
    return buffer.getvalue()


def bomb_texts() -> bytes:
    """Ten thousand times the same long text, which a Parquet file holds once."""
    long = pa.array(["x" * 10_000]).take(pa.array(np.zeros(10**4, np.int32)))
    return packed({"exp": pa.array(np.arange(10**4)), "id": long})


def bomb_archive() -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("parameters.csv", "exp,H,beta,m,V\n1,0.03,3.14,1.1,5\n")
        archive.writestr("exp1.csv", bytes(2 * 10**7))
    return buffer.getvalue()


def bomb_recording() -> bytes:
    buffer = io.BytesIO()
    columns = {name: np.zeros((3 * 10**6, 1)) for name in ("t", "vir", "qm")}
    savemat(buffer, columns, do_compression=True)
    return buffer.getvalue()


def bomb_weights() -> bytes:
    """Zeros that are packed, unlike those that torch writes."""
    buffer = io.BytesIO()
    plain = saved({**ABOUT, "state": {"coefficients": torch.zeros(2 * 10**7)}})
    with (
        zipfile.ZipFile(io.BytesIO(plain)) as source,
        zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as packed,
    ):
        for member in source.infolist():
            packed.writestr(member.filename, source.read(member))
    return buffer.getvalue()


def bomb_expanded() -> bytes:
    """One number that says that it is many."""
    return saved({**ABOUT, "state": {"coefficients": torch.zeros(1).expand(10**9, 3)}})


def bomb_json() -> bytes:
    return b"[" + b"[]," * 10**6 + b"[]]"


BOMBS = [
    ("parquet", "b.parquet", bomb_table),
    ("hdf5", "campaign.h5", bomb_hdf5),
    ("store", "signals.parquet", bomb_table),
    ("store", "experiments.parquet", bomb_texts),
    ("archive", "campaign.zip", bomb_archive),
    ("recording", "e.mat", bomb_recording),
    ("linear", "model.pt", bomb_weights),
    ("linear", "model.pt", bomb_expanded),
    ("diagnosis", "d.json", bomb_json),
]


@pytest.mark.parametrize(("name", "file", "bomb"), BOMBS)
@pytest.mark.usefixtures("little_memory")
def test_a_small_file_cannot_ask_for_all_memory(
    name: str, file: str, bomb: Callable[[], bytes], cases: dict[str, Case], tmp_path: Path
) -> None:
    """Of a file that grows when it is read both sizes are said, and nothing of it is read."""
    content, case = bomb(), cases[name]
    assert len(content) < 4 * 10**6
    case.put(tmp_path)
    (tmp_path / file).write_bytes(content)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    line = complaint(case.read, tmp_path, file)
    assert "is too large: would take" in line and "50 MB of them the most" in line, line
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # KB
