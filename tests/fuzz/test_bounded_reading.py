"""Small files of recorders take little memory and time, whatever they hold, and are told of in one line."""

import json
import os
import resource
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.fuzz.inputs import complaint
from tests.measurements.recorders import ANGLE, RECORDERS, T
from tests.measurements.systems import motor, run, write, write_tables
from unmodelled.api.answer_list import list_answers
from unmodelled.base import search
from unmodelled.base.errors import BadInput, Faults
from unmodelled.base.markers import links_in
from unmodelled.cli.sweep.runs import run_folders
from unmodelled.cli.verbs.init import init
from unmodelled.cli.written import written
from unmodelled.logs.folder import read_logs
from unmodelled.logs.readers import known
from unmodelled.logs.readers.reader import Table


def tables(path: Path) -> list[Table]:
    faults = Faults()
    found = known.read_files([path], None, faults)
    faults.check()
    return found[path]


@contextmanager
def within(seconds: float, megabytes: float) -> Iterator[None]:
    """Time and memory of this process."""
    began, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    assert time.process_time() - began < seconds
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1e3 * megabytes


def long_lists(path: Path) -> None:
    """Two million elements in some kB, as much as images."""
    lists = pa.array(np.zeros((2000, 1000)).tolist())
    pq.write_table(pa.table({"t": np.arange(2000.0), "image": lists}), path, compression="zstd")


def short_lists(path: Path) -> None:
    offsets = pa.array(np.arange(0, 4 * 10**6 + 1, 4, dtype=np.int32))
    lists = pa.ListArray.from_arrays(offsets, pa.array(np.zeros(4 * 10**6)))
    pq.write_table(pa.table({"q": lists}), path, compression="zstd")


def texts(path: Path) -> None:
    words = pa.DictionaryArray.from_arrays(pa.array(np.zeros(4 * 10**6, np.int32)), pa.array(["idle"]))
    pq.write_table(pa.table({"state": words.cast(pa.string())}), path, compression="zstd")


def long_texts(path: Path) -> None:
    """Texts of 1 MB, which take some kB on the disk; as the pages of their column have them."""
    pq.write_table(pa.table({"t": np.arange(20.0), "note": 20 * [10**6 * "x"]}), path, use_dictionary=False)


def different_texts(path: Path) -> None:
    pq.write_table(pa.table({"note": [f"{k}{10**6 * 'x'}" for k in range(20)]}), path, compression="zstd")


def long_texts_in_lists(path: Path) -> None:
    pq.write_table(pa.table({"notes": [[f"{k}{10**6 * 'x'}"] for k in range(20)]}), path, compression="zstd")


def test_pictures_in_cells_are_not_read(tmp_path: Path, little_memory: None) -> None:
    """As data sets of robots have them beside numbers."""
    pictures = [{"bytes": 10**6 * b"x", "path": "a.png"}] * 80
    columns = {"t": T, "theta": ANGLE, "camera": pictures, "mask": [10**6 * b"y"] * 80}
    pq.write_table(pa.table(columns), path := tmp_path / "a.parquet", use_dictionary=False)
    with within(2.0, 60.0):
        (table,) = tables(path)
    assert list(table.columns) == ["t", "theta"] and not table.texts


@pytest.mark.parametrize(
    "content", [long_lists, short_lists, texts, long_texts, different_texts, long_texts_in_lists]
)
def test_lists_and_texts_of_parquet_files_count_with_their_size(
    tmp_path: Path, content: Callable[[Path], None], little_memory: None
) -> None:
    content(tmp_path / "a.parquet")
    assert (tmp_path / "a.parquet").stat().st_size < 10**6
    told = r"a\.parquet.*is too large: would take .* 50 MB of them"
    with within(2.0, 100.0), pytest.raises(BadInput, match=told):
        tables(tmp_path / "a.parquet")


def test_long_lists_in_cells_are_not_padded(tmp_path: Path) -> None:
    rows = [f'{k},"[1]"' for k in range(10_000)]
    rows[77] = f'77,"{[0] * 10_000}"'
    (tmp_path / "a.csv").write_text("t,scan\n" + "\n".join(rows))
    with within(2.0, 60.0):
        (table,) = tables(tmp_path / "a.csv")
    assert list(table.columns) == ["t"]


def test_short_lists_in_many_rows_are_refused_before_they_are_padded(
    tmp_path: Path, little_memory: None
) -> None:
    rows = [f"{k}," for k in range(80_000)]
    rows[0] = f'0,"{[0] * 64}"'
    (tmp_path / "a.csv").write_text("t,scan\n" + "\n".join(rows))
    with pytest.raises(BadInput, match=r"a\.csv: column scan: is too large: would take 81\.9 MB"):
        tables(tmp_path / "a.csv")


def test_records_that_share_no_field_are_refused(tmp_path: Path, little_memory: None) -> None:
    (tmp_path / "a.json").write_text(json.dumps([{f"k{k}": 1} for k in range(4000)]))
    with within(2.0, 60.0), pytest.raises(BadInput, match="is too large for the memory that is left"):
        tables(tmp_path / "a.json")


@pytest.mark.parametrize("ending", ["csv.zst", "csv.gz", "csv.bz2", "csv.xz", "csv.zip"])
def test_the_ending_of_a_text_does_not_unpack_it(tmp_path: Path, ending: str) -> None:
    """A text is read as one, and so is what a program that unpacks would skip."""
    body = "t,x\n" + "\n".join(f"{k},{k % 7}" for k in range(90))
    (tmp_path / f"a.{ending}").write_text(body)
    (table,) = tables(tmp_path / f"a.{ending}")
    assert len(table) == 90 and list(table.columns) == ["t", "x"]
    skipped = b"P*M\x18" + struct.pack("<I", 400) + b"t,x\n" + b"1,2\n" * 99  # a skippable frame of zstd
    (tmp_path / f"b.{ending}").write_bytes(skipped + b"\x28\xb5\x2f\xfd" + bytes(range(256)))
    with within(2.0, 60.0), pytest.raises(BadInput):
        tables(tmp_path / f"b.{ending}")


@pytest.mark.parametrize(("suffix", "rows"), [("csv", 60), ("parquet", 600)])
def test_long_texts_do_not_lengthen_other_cells(tmp_path: Path, suffix: str, rows: int) -> None:
    """As texts of equal length the column would take 1.6 GB."""
    log: dict[str, Any] = {**run(20_000), "trial": ["one"] * 20_000}
    log["trial"][6000 : 6000 + rows] = [20_000 * "x"] * rows
    write_tables(tmp_path, {"a": log}, suffix)
    with within(30.0, 150.0):
        init(tmp_path / f"a.{suffix}", None, None, tmp_path / "drafts")
        found = read_logs(write(tmp_path, {}, files=f"a.{suffix}", split_by="trial"), motor())
    assert found.ids == ("one-1", 100 * "x", "one-2")


def tidy(folder: Path, name: str) -> None:
    """A log folder of one run whose file has this name."""
    write(folder, {"a": run(60)})
    (folder / "mapping.yaml").unlink()
    (folder / "a.csv").rename(folder / name)
    (folder / "experiments.csv").write_text(f"id,file,m\na,{name},0.5\n")


def test_a_tidy_log_is_not_unpacked_by_its_ending(tmp_path: Path) -> None:
    tidy(tmp_path, "a.csv.bz2")
    assert len(read_logs(tmp_path, motor()).t) == 60


WORDS = {f"names{k}": [f"a{k}", f"b{k}"] for k in range(400)}
LISTS = {f"x{k}": [0.5, k] for k in range(400)}
DIGITS = "9" * 20_000 + "x"
ROWS = "\n".join(f"{k},{k % 7}" for k in range(90))
SLOW = {
    "names.json": json.dumps([{**WORDS, **LISTS}] * 2),
    "lengths.json": json.dumps({f"x{k}": [0] * (k + 2) for k in range(400)}),
    "cell.csv": f"t,x\n0,{DIGITS}\n{ROWS}",
    "header.csv": f"t,{DIGITS}\n{ROWS}",
    "spaces.csv": f"t,x{' ' * 60_000}y\n{ROWS}",
    "brackets.csv": f"t,{'[' * 60_000}y\n{ROWS}",
    "comma.csv": f"t;x\n0;{DIGITS},\n{ROWS.replace(',', ';')}",
}


@pytest.mark.parametrize("file", SLOW)
def test_long_texts_and_many_lists_take_little_time(tmp_path: Path, file: str) -> None:
    (tmp_path / file).write_text(SLOW[file])
    with within(1.5, 100.0):
        line = complaint(tables, tmp_path / file, file)
    assert not line or "its name has" in line


@pytest.mark.parametrize("name", ["x" * 5000, "x" + " " * 5000 + "y"])
def test_names_that_are_too_long_are_refused_in_every_format(tmp_path: Path, name: str) -> None:
    (tmp_path / "a.json").write_text(json.dumps([{"t": 1, name: 2}] * 5))
    arrays: dict[str, Any] = {name: np.arange(9.0)}
    np.savez(tmp_path / "a.npz", **arrays)
    for path in sorted(tmp_path.iterdir()):
        assert "its name has 500" in complaint(tables, path, path.name)


def test_cells_of_digits_in_a_tidy_log_take_little_time(tmp_path: Path) -> None:
    tidy(tmp_path, "a.csv")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    lines[9] = f"0.016,{DIGITS},1,6"
    (tmp_path / "a.csv").write_text("\n".join(lines))
    with within(1.0, 60.0):
        assert "row 10: column angle" in complaint(lambda f: read_logs(f, motor()), tmp_path, "a.csv")


@pytest.mark.parametrize("length", ["1e-9 s", "1e-300 s", "3 ms"])
def test_cuts_that_are_too_short_end(tmp_path: Path, length: str) -> None:
    write(tmp_path, {"a": run(20_000)}, cut=length)
    with within(2.0, 60.0):
        assert "hold fewer than 50 samples" in complaint(lambda f: read_logs(f, motor()), tmp_path, "a.csv")


def test_patterns_of_many_folders_end(tmp_path: Path) -> None:
    deep = tmp_path.joinpath(*["d"] * 25)
    deep.mkdir(parents=True)
    write(deep, {"a": run(60)})
    # the last pattern meets a link to a folder above
    above = "../" * 40 + str(tmp_path)[1:]
    for files in ("**/**/**/**/**/*.csv", "**/*/**/*/**/*/**/*.csv", f"{above}/**/a.*", "**/*.csv"):
        with within(1.0, 60.0):
            assert read_logs(write(tmp_path, {}, files=files), motor()).ids == ("a",)
        if files == f"{above}/**/a.*":
            (deep / "up").symlink_to(tmp_path)


@pytest.mark.parametrize(("limit", "value"), [("ENTRIES", 30), ("SECONDS", 0.0)])
def test_a_search_of_a_whole_machine_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: str, value: float
) -> None:
    """The limits are lower here, for a whole machine takes its time."""
    monkeypatch.setattr(search, limit, value)
    for number in range(40):
        (tmp_path / f"other{number}").touch()
    place = write_tables(tmp_path / "logs", {"a": run(60)})
    for files in (
        "../" * 40 + str(tmp_path)[1:] + "/**/*.csv",
        f"{tmp_path}/**/etc/**/x",
        f"{tmp_path}/*/a*/*",
    ):
        write(place, {}, files=files)
        assert "to look through" in complaint(lambda f: read_logs(f, motor()), place, "mapping.yaml")
    (tmp_path / "metadata.yaml").touch()  # which makes it one recording
    for look in (list_answers, run_folders, links_in, tables):
        with pytest.raises(BadInput, match="to look through"):
            look(tmp_path)
    assert written("program", "verb", {"out": tmp_path.parent}, time.time() + 1.0).startswith("wrote ")


def bag(folder: Path) -> Path:
    return RECORDERS["bag_2"].write(folder / "walk")


def mapped(folder: Path, file: str) -> object:
    signals = {"angle": RECORDERS["bag_2"].angle, "voltage": RECORDERS["bag_2"].voltage}
    return read_logs(write(folder, {}, files=file, signals=signals, time=None), motor())


def test_a_pipe_in_a_bag_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(bag(tmp_path) / "walk_1.db3")
    for read in (lambda f: mapped(f, "walk"), lambda f: init(f / "walk", None, None, f / "drafts")):
        assert "walk_1.db3: is a named pipe, not a regular file" in complaint(read, tmp_path, "walk_1.db3")


@pytest.mark.long
def test_a_broken_link_in_a_bag_is_no_traceback(tmp_path: Path) -> None:
    (bag(tmp_path) / "notes").symlink_to(tmp_path / "nowhere")
    assert len(mapped(tmp_path, "walk").ids) == 1  # type: ignore[attr-defined]
    data = next((tmp_path / "walk").glob("*.db3"))
    data.rename(tmp_path / "elsewhere")
    data.symlink_to(tmp_path / "nowhere")
    line = complaint(lambda f: mapped(f, "walk"), tmp_path, "walk")
    assert "walk: not in format ROS bag, or damaged" in line


class Waiting:
    """A reader that waits for ever, and uses no processor."""

    name, install, isolated = "waiting", "", True

    def recognises(self, path: Path, start: bytes) -> bool:
        return start.startswith(b"WAITING")

    def read(self, path: Path, wanted: object) -> list[Table]:
        os.write(1, b"a library that prints\n")
        time.sleep(600.0)
        return []


def test_what_waits_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.txt").write_text("WAITING")
    monkeypatch.setattr(known, "SECONDS", 0.1)
    monkeypatch.setattr(known, "readers", lambda: (Waiting(),))
    monkeypatch.setattr("unmodelled.base.workers.get_start_method", lambda allow_none: "fork")
    began = time.monotonic()
    line = complaint(tables, tmp_path / "a.txt", "a.txt")
    assert "the library for waiting crashes on it, or does not end" in line
    assert time.monotonic() - began < 10.0
    assert "prints" not in "".join(capfd.readouterr())
