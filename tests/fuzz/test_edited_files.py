"""Valid files after random edits: read, or refused in one line that names them."""

import shutil
from pathlib import Path

import pytest

from tests.fuzz.inputs import Case, complaint, draws, edited

NAMES = [
    *("system", "table", "events", "logs", "parquet", "hdf5", "store", "observations", "sweep"),
    *("diagnosis", "judged", "truth", "refit", "bounce", "archive", "recording", "linear", "hybrid", "fit"),
    *("lstm", "mapping", "init", "mat", "mcap", "bag_1", "mdf", "ulog", "dataflash", "tdms", "wpilog"),
    *("xl330", "so101", "ur10e_joint", "cascaded_tanks"),
]


def test_all_readers_are_named(cases: dict[str, Case]) -> None:
    assert set(NAMES) == set(cases)


@pytest.mark.parametrize("name", NAMES)
def test_the_example_is_read(name: str, cases: dict[str, Case], tmp_path: Path) -> None:
    cases[name].put(tmp_path / "input")
    cases[name].whole(cases[name].read(tmp_path / "input"))


@pytest.mark.parametrize("name", NAMES)
def test_edited_files_are_read_or_refused(name: str, cases: dict[str, Case], tmp_path: Path) -> None:
    case, folder = cases[name], tmp_path / "input"
    for draw in draws(case.share):
        with draw:
            file = draw.choice(case.edits)
            case.put(folder)
            (folder / file).write_bytes(edited(case.files[file], draw))
            if not complaint(case.read, folder, file):
                case.whole(case.read(folder))
        shutil.rmtree(folder)
