"""System and logs in every form that a caller may give them in; frames equal to a folder."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import unmodelled as um
from tests.measurements.systems import assert_same, motor, run, write_folder

SYSTEM, LOGS = um.example("pendulum")
FRAMES = {str(name): frame for name, frame in LOGS.table().groupby("experiment")}


@pytest.mark.parametrize(
    "logs",
    [
        LOGS.source,
        Path(LOGS.source),
        FRAMES,
        list(FRAMES.values()),
        LOGS.table(),
        {name: frame.set_index("t") for name, frame in FRAMES.items()},
    ],
    ids=["text", "path", "by id", "list", "one frame", "time as index"],
)
def test_logs_in_every_form_have_the_same_gap(logs: object) -> None:
    found = um.simulate(SYSTEM.source, logs)  # type: ignore[arg-type]
    assert found.logs.ids == LOGS.ids
    assert found.value == pytest.approx(um.simulate(SYSTEM, LOGS).value, rel=1e-9)


def test_a_result_stands_for_its_system() -> None:
    fit = um.train(SYSTEM.source, LOGS.source, um.one_per_port(hidden=8))
    first = um.simulate(fit, LOGS)
    again = um.simulate(first, Path(LOGS.source))
    assert first.system == SYSTEM and again.value == first.value
    assert um.identifiability(first, FRAMES).system == SYSTEM
    assert np.isfinite(um.evaluate(fit, list(FRAMES.values())).table()["median"]).all()


@pytest.mark.parametrize(
    ("system", "logs", "words"),
    [
        (SYSTEM, 3, "logs: must be logs, the path of their folder, a data frame, or data frames in a list"),
        (SYSTEM, [3], r"logs\['run1'\]: must be a data frame or a mapping of columns, got int"),
        (
            SYSTEM,
            {"a": FRAMES["run1"].to_numpy()},
            r"logs\['a'\]: must be a data frame or a mapping of columns, got ndarray",
        ),
        (SYSTEM, pd.DataFrame({"x": [1.0]}), r"frames\['run1'\]: row 1: column t is missing"),
        (3, LOGS, "system: must be a system, the path of its file, or a result that has one, such as an"),
        ("none.yaml", LOGS, "none.yaml: no such file"),
        (SYSTEM, "none", "none: no such folder"),
    ],
)
def test_anything_else_is_refused(system: object, logs: object, words: str) -> None:
    with pytest.raises(um.BadInput, match=words):
        um.simulate(system, logs)  # type: ignore[arg-type]


MOTOR = motor()


def table(**columns: list[object]) -> pd.DataFrame:
    return pd.DataFrame({"m": [0.5, 0.1 + 0.2], **columns}, index=["a", "b"])


def test_frames_are_read_like_a_folder(tmp_path: Path) -> None:
    made = um.Logs.from_frames(changed(), MOTOR, table(group=["g", "g"]))
    logs = {name: {c: f[c].to_numpy() for c in f} for name, f in changed().items()}
    write_folder(tmp_path / "logs", logs, "parquet", m=[0.5, 0.1 + 0.2], group=["g", "g"])
    read = um.read_logs(tmp_path / "logs", MOTOR)
    assert_same(made, read, "provenance")
    own, theirs = (each.experiments.drop(columns="file") for each in (made, read))
    pd.testing.assert_frame_equal(own, theirs, check_like=True)
    assert (made.provenance["data"], made.source, read.source) == ("measured", "", str(tmp_path / "logs"))


def test_the_index_of_a_frame_does_not_matter() -> None:
    other = {name: frame.set_index(frame.index * 2.0 + 7.0) for name, frame in changed().items()}
    one, two = (um.Logs.from_frames(f, MOTOR, table()) for f in (changed(), other))
    np.testing.assert_array_equal(one.y, two.y)


def changed(**columns: object) -> dict[str, pd.DataFrame]:
    """Frames with other columns in the second one."""
    return {"a": pd.DataFrame(run()), "b": pd.DataFrame(run(rate=2.0)).assign(**columns)}


def spoilt(column: str, row: int, value: object) -> dict[str, pd.DataFrame]:
    """Frames with one other cell in the second one, rows counted from 1."""
    values: list[object] = changed()["b"][column].tolist()
    values[row - 1] = value
    return changed(**{column: values})


IN_B = r"frames\['b'\]: "
CAPITAL = {**changed(), "b": changed()["b"].rename(columns={"angle": "Angle"})}
IDS = "its index and the frames must have the same ids; 'b' is in one"
REFUSED = [
    (spoilt("t", 7, 0.0), table(), IN_B + "row 7: column t: time must increase"),
    (spoilt("angle", 3, np.nan), table(), IN_B + "row 3: column angle: an empty cell is not a finite"),
    (spoilt("angle", 3, None), table(), IN_B + "row 3: column angle"),
    (changed(angle="x"), table(), IN_B + "row 1: column angle: 'x' is not"),
    (spoilt("angle", 3, "x"), table(), IN_B),
    (CAPITAL, table(), IN_B + "row 1: column angle is missing; there is 'Angle': rename it"),
    (changed(angle=1.0), table(), IN_B + "row 1: column angle: dead output"),
    ({**changed(), "b": changed()["b"].head(20)}, table(), "column t: must have 50 samples or more, got 20"),
    (changed(), None, "experiments: row 1: column m is missing"),
    (changed(), table().assign(m=["x", 1.0]), "experiments: row 2: column m: 'x' is not a finite number"),
    (changed(), table().rename(index={"b": "c"}), IDS),
    ({}, None, "experiments: row 1: column id: no experiments below it"),
]


@pytest.mark.parametrize(("given", "experiments", "words"), REFUSED)
def test_what_the_reader_refuses_is_refused(
    given: dict[str, pd.DataFrame], experiments: pd.DataFrame | None, words: str
) -> None:
    with pytest.raises(um.BadInput, match=words) as refused:
        um.Logs.from_frames(given, MOTOR, experiments)
    said = [str(refused.value), *refused.value.others]
    assert not any("tmp" in line or ".parquet" in line for line in said), said


def test_the_index_stands_for_the_time() -> None:
    seconds = {name: frame.set_index("t") for name, frame in changed().items()}
    start = pd.Timestamp("2026-03-29 00:59:58", tz="Europe/Brussels")  # summer time begins in the log
    dates = {n: f.set_index(start + pd.to_timedelta(f.index, "s")) for n, f in seconds.items()}
    spans = {n: f.set_index(pd.to_timedelta(f.index, "s")) for n, f in seconds.items()}
    columns = {n: f.reset_index(names="t") for n, f in dates.items()}
    wanted = um.Logs.from_frames(changed(), MOTOR, table())
    for other in (seconds, dates, spans, columns):
        read = um.Logs.from_frames(other, MOTOR, table())
        np.testing.assert_allclose(read.t, wanted.t, atol=1e-9)
        np.testing.assert_allclose(read.y, wanted.y, atol=1e-9)


@pytest.mark.parametrize(
    ("given", "line"),
    [
        (
            {"a": {"t": [0.0, 1.0], "theta": [1.0]}},
            r"logs\['a'\]: columns must be equally long: t has 2, theta has 1",
        ),
        ({"a": 5}, r"logs\['a'\]: must be a data frame or a mapping of columns, got int"),
        (
            [{"t": [[0.0], [1.0]]}],
            r"logs\['run1'\]: column t: must have one number per sample, got shape \(2, 1\)",
        ),
        (5, "logs: must be logs, the path of their folder"),
    ],
)
def test_what_is_no_frame_is_refused_in_one_line(given: Any, line: str) -> None:
    with pytest.raises(um.BadInput, match=f"^{line}"):
        um.Logs.from_frames(given, um.example("pendulum")[0])
