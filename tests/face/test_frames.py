"""Logs from data frames: equal to those from a folder, and refused in the same words."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled as um
from tests.measurements.systems import motor, run, write_folder

SYSTEM = motor()


def frames() -> dict[str, pd.DataFrame]:
    return changed()


def table(**columns: list[object]) -> pd.DataFrame:
    return pd.DataFrame({"m": [0.5, 0.1 + 0.2], **columns}, index=["a", "b"])


def test_frames_are_read_like_a_folder(tmp_path: Path) -> None:
    made = um.Logs.from_frames(frames(), SYSTEM, table(group=["g", "g"]))
    logs = {name: {c: f[c].to_numpy() for c in f} for name, f in frames().items()}
    write_folder(tmp_path / "logs", logs, "parquet", m=[0.5, 0.1 + 0.2], group=["g", "g"])
    read = um.read_logs(tmp_path / "logs", SYSTEM)
    for field in fields(um.Logs):
        if field.name not in ("experiments", "provenance", "source"):
            np.testing.assert_equal(getattr(made, field.name), getattr(read, field.name), field.name)
    pd.testing.assert_frame_equal(
        made.experiments.drop(columns="file"), read.experiments.drop(columns="file"), check_like=True
    )
    assert (made.provenance["data"], made.source, read.source) == ("measured", "", str(tmp_path / "logs"))


def test_the_index_of_a_frame_does_not_matter() -> None:
    other = {name: frame.set_index(frame.index * 2.0 + 7.0) for name, frame in frames().items()}
    one, two = (um.Logs.from_frames(f, SYSTEM, table()) for f in (frames(), other))
    np.testing.assert_array_equal(one.y, two.y)


def changed(**columns: object) -> dict[str, pd.DataFrame]:
    """Frames with other columns in the second one."""
    return {"a": pd.DataFrame(run()), "b": pd.DataFrame(run(rate=2.0)).assign(**columns)}


def spoilt(column: str, row: int, value: object) -> dict[str, pd.DataFrame]:
    """Frames with one other cell in the second one, rows counted from 1."""
    values: list[object] = frames()["b"][column].tolist()
    values[row - 1] = value
    return changed(**{column: values})


REFUSED = [
    (spoilt("t", 7, 0.0), table(), r"frames\['b'\]: row 7: column t: time must increase"),
    (
        spoilt("angle", 3, np.nan),
        table(),
        r"frames\['b'\]: row 3: column angle: an empty cell is not a finite",
    ),
    (spoilt("angle", 3, None), table(), r"frames\['b'\]: row 3: column angle"),
    (changed(angle="x"), table(), r"frames\['b'\]: row 1: column angle: 'x' is not"),
    (spoilt("angle", 3, "x"), table(), r"frames\['b'\]: "),
    (
        {**frames(), "b": frames()["b"].rename(columns={"angle": "Angle"})},
        table(),
        r"frames\['b'\]: row 1: column angle is missing; there is 'Angle': rename it",
    ),
    (changed(angle=1.0), table(), r"frames\['b'\]: row 1: column angle: dead output"),
    ({**frames(), "b": frames()["b"].head(20)}, table(), r"column t: must have 50 samples or more, got 20"),
    (frames(), None, "experiments: row 1: column m is missing"),
    (frames(), table().assign(m=["x", 1.0]), "experiments: row 2: column m: 'x' is not a finite number"),
    (
        frames(),
        table().rename(index={"b": "c"}),
        "its index and the frames must have the same ids; 'b' is in one",
    ),
    ({}, None, "experiments: row 1: column id: no experiments below it"),
]


@pytest.mark.parametrize(("given", "experiments", "words"), REFUSED)
def test_what_the_reader_refuses_is_refused(
    given: dict[str, pd.DataFrame], experiments: pd.DataFrame | None, words: str
) -> None:
    with pytest.raises(um.BadInput, match=words) as refused:
        um.Logs.from_frames(given, SYSTEM, experiments)
    said = [str(refused.value), *refused.value.others]
    assert not any("tmp" in line or ".parquet" in line for line in said), said


def test_the_index_stands_for_the_time() -> None:
    seconds = {name: frame.set_index("t") for name, frame in frames().items()}
    start = pd.Timestamp("2026-03-29 00:59:58", tz="Europe/Brussels")  # summer time begins in the log
    dates = {n: f.set_index(start + pd.to_timedelta(f.index, "s")) for n, f in seconds.items()}
    spans = {n: f.set_index(pd.to_timedelta(f.index, "s")) for n, f in seconds.items()}
    columns = {n: f.reset_index(names="t") for n, f in dates.items()}
    wanted = um.Logs.from_frames(frames(), SYSTEM, table())
    for other in (seconds, dates, spans, columns):
        read = um.Logs.from_frames(other, SYSTEM, table())
        np.testing.assert_allclose(read.t, wanted.t, atol=1e-9)
        np.testing.assert_allclose(read.y, wanted.y, atol=1e-9)
