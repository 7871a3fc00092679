"""Valid files after random edits: read, or refused in one line that names them."""

from __future__ import annotations

import shutil

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.fuzz.inputs import Case, complaint, edited, fuzzed

NAMES = [
    *("system", "table", "events", "logs", "parquet", "store", "observations", "sweep"),
    *("diagnosis", "judged", "truth", "refit", "bounce", "archive", "recording", "linear", "hybrid", "lstm"),
]


def test_all_readers_are_named(cases: dict[str, Case]) -> None:
    assert set(NAMES) == set(cases)


@pytest.mark.parametrize("name", NAMES)
def test_the_example_is_read(
    name: str, cases: dict[str, Case], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp(name)
    cases[name].put(folder)
    cases[name].whole(cases[name].read(folder))


@pytest.mark.parametrize("name", NAMES)
@given(data=st.data())
@fuzzed
def test_edited_files_are_read_or_refused(
    name: str, cases: dict[str, Case], tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    case, folder = cases[name], tmp_path_factory.getbasetemp() / f"edited_{name}"
    file = data.draw(st.sampled_from(case.edits))
    content = data.draw(edited(case.files[file]))
    case.put(folder)
    (folder / file).write_bytes(content)
    try:
        if not complaint(case.read, folder, file):
            case.whole(case.read(folder))
    finally:
        shutil.rmtree(folder)
