"""Logs as HDF5: the same arrays as from CSV and Parquet, and the same refusals."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest

from tests.machines.known import refusals
from tests.measurements.systems import assert_same, motor, refused, run, write_folder
from unmodelled import Logs, read_logs
from unmodelled.base.errors import BadInput, Faults
from unmodelled.logs import hdf5

LOGS = {"b": run(400, rate=7.0), "a": run(60)}
SI, CONVERT = "must be in SI units, e.g.", ": convert the values, or correct the attribute"
DEGREES = f"{SI} rad instead of deg: 1 deg = 0.0174533 rad{CONVERT}"
UNITS = {"t": "s", "angle": "rad", "voltage": "V"}


def put(group: Any, **columns: Any) -> Any:
    """Write a log into a group, with other columns than those of `run`."""
    for name, values in {**run(60), **columns}.items():
        if values is not None:
            group[name] = values
    return group


def write_files(folder: Path, group: str = "") -> Path:
    """A log folder with an HDF5 file for each of the logs, in a group of it if there is one."""
    folder.mkdir()
    for name, log in LOGS.items():
        with h5py.File(folder / f"{name}.h5", "w") as file:
            put(file.create_group(group) if group else file, **log)
    file_names = [f"{name}.h5" + (f":/{group}" if group else "") for name in LOGS]
    table = pd.DataFrame({"id": list(LOGS), "file": file_names, "m": [0.5, 0.25]})
    table.to_csv(folder / "experiments.csv", index=False)
    return folder


def write_container(path: Path) -> Path:
    with h5py.File(path, "w", track_order=True) as file:
        for (name, log), mass in zip(LOGS.items(), (0.5, 0.25), strict=True):
            put(file.create_group(name), **log).attrs["m"] = mass
    return path


def assert_equal(found: Logs, expected: Logs) -> None:
    assert_same(found, expected, "provenance")
    other = [found.experiments.drop(columns="file"), expected.experiments.drop(columns="file")]
    pd.testing.assert_frame_equal(*other, check_like=True)


def test_all_formats_give_the_same_arrays(tmp_path: Path) -> None:
    expected = read_logs(write_folder(tmp_path / "csv", LOGS, m=[0.5, 0.25]), motor())
    assert expected.ids == ("b", "a") and expected.c.tolist() == [[0.5], [0.25]]
    for place in [
        write_folder(tmp_path / "parquet", LOGS, "parquet", m=[0.5, 0.25]),
        write_files(tmp_path / "files"),
        write_files(tmp_path / "groups", "day 1/first"),
        write_container(tmp_path / "campaign.h5"),
    ]:
        assert_equal(read_logs(place, motor()), expected)


def test_columns_as_matlab_writes_them(tmp_path: Path) -> None:
    """Rows of a matrix, integers and single precision, in the other byte order, behind 512 bytes of text."""
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        put(file, t=run(60)["t"][None], angle=run(60)["angle"][:, None].astype(">f4"), voltage=np.arange(60))
    with (tmp_path / "a.mat").open("r+b") as text:
        text.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    (tmp_path / "experiments.csv").write_text("id,file,m\na,a.mat,0.5\n")
    logs = read_logs(tmp_path, motor())
    np.testing.assert_array_equal(logs.y[:, 0], run(60)["angle"].astype(np.float32))
    np.testing.assert_array_equal(logs.u[:, 0], np.arange(60.0))


def test_what_is_written_comes_back(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "csv", LOGS, m=[0.1, 1 / 3], operator=["ann", ""], group=["g", "g"])
    (folder / "provenance.json").write_text('{"data": "virtual", "seed": 3}')
    logs = read_logs(folder, motor())
    logs.to_hdf5(tmp_path / "campaign.h5", motor())
    again = read_logs(tmp_path / "campaign.h5", motor())
    assert_equal(again, logs)
    assert again.provenance == {"data": "virtual", "seed": 3}
    with h5py.File(tmp_path / "campaign.h5") as file:
        assert {name: file["a"][name].attrs["unit"] for name in file["a"]} == UNITS
    logs.to_hdf5(tmp_path / "again.h5", motor())
    assert (tmp_path / "again.h5").read_bytes() == (tmp_path / "campaign.h5").read_bytes()


def test_logs_with_delays_or_an_id_with_a_slash_are_not_written(tmp_path: Path) -> None:
    """Delayed inputs would be delayed once more when they are read; a slash separates groups."""
    delayed = motor(input_delay=0.01)
    logs = read_logs(write_folder(tmp_path / "csv", LOGS, id=["day/1", "a"]), delayed)
    with pytest.raises(BadInput, match="no delays"):
        logs.to_hdf5(tmp_path / "campaign.h5", delayed)
    logs = read_logs(tmp_path / "csv", motor())
    with pytest.raises(BadInput, match="the experiment 'day/1' cannot be a group"):
        logs.to_hdf5(tmp_path / "campaign.h5", motor())
    assert not (tmp_path / "campaign.h5").exists()


def bad_groups(file: Any) -> dict[str, str]:
    t = run(60)["t"]
    put(file.create_group("capital"), angle=None, Angle=t).attrs["m"] = 0.5
    put(file.create_group("other"), angle=None, phi=t)
    angles = {
        "infinite": np.where(np.arange(60) == 7, np.inf, t),
        "huge": np.where(np.arange(60) > 7, 1e200, t),
        "text": np.array([b"1.0"] * 60),
        "matrix": np.ones((60, 2)),
        "scalar": 1.0,
        "longer": np.arange(61.0),
        "dead": np.full(60, 0.25),
        "soft": h5py.SoftLink("/other/t"),
        "external": h5py.ExternalLink("/etc/passwd", "/t"),
    }
    for name, angle in angles.items():
        put(file.create_group(name), angle=angle)
    put(file.create_group("nested"), angle=None).create_group("angle")
    outside = put(file.create_group("outside"), angle=None)
    outside.create_dataset("angle", 60, "f8", external=[("/etc/passwd", 0, 480)])
    layout = h5py.VirtualLayout(60, "f8")
    layout[:] = h5py.VirtualSource("/etc/passwd", "t", 60)
    put(file.create_group("virtual"), angle=None).create_virtual_dataset("angle", layout)
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_chunk((60,))
    plan.set_filter(32001, h5py.h5z.FLAG_OPTIONAL)
    group = put(file.create_group("blosc"), angle=None).id
    h5py.h5d.create(group, b"angle", h5py.h5t.NATIVE_DOUBLE, h5py.h5s.create_simple((60,)), plan)
    put(file.create_group("degrees"))["angle"].attrs["unit"] = "deg"
    put(file.create_group("metres"))["angle"].attrs["units"] = "m"
    put(file.create_group("milliseconds"))["t"].attrs["unit"] = "ms"
    put(file.create_group("gap"), t=np.where(np.arange(60) < 30, t, t + 0.0081))
    put(file.create_group("fine"))["angle"].attrs["unit"] = "1"
    return {
        "capital": "column angle is missing; there is 'Angle': rename it",
        "other": "column angle is missing; the group has 'phi', 'speed', 't', 'voltage'",
        "infinite": "row 8: column angle: inf is not a finite number below 1e+100",
        "huge": "row 9: column angle: 1e+200 is not a finite number below 1e+100 (the first of 52 such rows)",
        "text": "column angle: must be a column of numbers, got shape (60,) of |S3",
        "matrix": "column angle: must be a column of numbers, got shape (60, 2) of float64",
        "scalar": "column angle: must be a column of numbers, got shape () of float64",
        "longer": "column angle: must have 60 samples like t, got 61",
        "nested": "column angle: is a group, not a dataset",
        "soft": "'angle' is a link to another place: store a copy of the data instead",
        "external": "'angle' is a link to another place: store a copy of the data instead",
        "outside": "column angle: its data lie in another file: store a copy of the data instead",
        "virtual": "column angle: its data lie in another file: store a copy of the data instead",
        "blosc": "column angle: needs a plug-in to be unpacked: compress it with gzip",
        "degrees": f"column angle: attribute unit: 'deg' {DEGREES}",
        "metres": "column angle: attribute unit: 'm', the system file has 'rad': correct one of them",
        "milliseconds": f"column t: attribute unit: 'ms' {SI} s instead of ms: 1 ms = 0.001 s{CONVERT}",
        "gap": "row 31: column t: gap of 0.0101 s, more than 5 sampling periods of 0.002 s: "
        "no part without a gap has 50 samples or more",
        "dead": "row 1: column angle: dead output, 0.25 in every row while its drive moves: "
        "leave the experiment out",
        "none": "no such group",
        "other/t": "is a dataset, not a group of datasets",
    }


def test_every_bad_group_is_refused_with_one_line(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "all.h5", "w") as file:
        expected = bad_groups(file)
    ids = [*expected, "fine"]
    table = pd.DataFrame({"id": ids, "file": [f"all.h5:/{name}" for name in ids], "m": 0.5})
    table.to_csv(tmp_path / "experiments.csv", index=False)
    lines = refused(tmp_path).split("\n")
    place = tmp_path / "all.h5"
    assert sorted(lines) == sorted(f"{place}:/{name}: {text}" for name, text in expected.items())


def test_a_container_is_refused(tmp_path: Path) -> None:
    path = write_container(tmp_path / "campaign.h5")

    def complaint() -> str:
        return refused(path).replace(str(path), "h5")

    with h5py.File(path, "r+") as file:
        file["b"].attrs["m"] = "heavy"
        assert "m" in file["a"].attrs
    assert complaint() == "h5: row 1: column m: 'heavy' is not a finite number below 1e+100"
    with h5py.File(path, "r+") as file:
        del file["a"].attrs["m"]
    assert complaint() == "h5:/a: attribute m is missing: write it as a number"
    with h5py.File(path, "r+") as file:
        file["c"] = h5py.ExternalLink("/etc/passwd", "/")
    assert complaint() == "h5: 'c' is a link to another place: store a copy of the data instead"
    for provenance in ("{", json.dumps({"data": "imagined"}), json.dumps([1])):
        with h5py.File(write_container(path), "r+") as file:
            file.attrs["provenance"] = provenance
        assert complaint().startswith("h5: ")
    with h5py.File(path, "w") as file:
        file["x"] = 1.0
    assert complaint().startswith("h5: holds no groups")
    with h5py.File(path, "w") as file:
        put(file)
    assert complaint().startswith("h5: is one experiment: name it in the column file of experiments.csv")


def test_a_group_of_a_file_that_has_none(tmp_path: Path) -> None:
    write_folder(tmp_path, {"a": run(60)}, file=["a.csv:/first"])
    assert "row 2: column file: 'a.csv' has no group 'first': it is not an HDF5" in refused(tmp_path)


def test_a_file_on_which_the_library_does_not_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The ones before it are read, it is named, and the ones after it are left for the next time."""

    def refuse(place: str, *_: object) -> None:
        while place.endswith("/a"):
            pass

    monkeypatch.setattr("unmodelled.base.workers.get_start_method", lambda allow_none: "fork")
    monkeypatch.setattr(hdf5, "SECONDS", 0.3)
    monkeypatch.setattr(hdf5, "refuse_missing", refuse)
    path, faults = write_container(tmp_path / "campaign.h5"), Faults()
    first, second = hdf5.Address(path, "b"), hdf5.Address(path, "a")
    found = hdf5.read_hdf5([first, second, hdf5.Address(path, "b")], UNITS, faults)
    np.testing.assert_array_equal(found[first].values["angle"], LOGS["b"]["angle"])
    assert list(found) == [first]
    (line,) = refusals(faults.check)
    assert "a: damaged: the HDF5 library crashes on it, or does not end" in line
