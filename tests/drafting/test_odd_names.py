"""Whatever names and units logs have, init prints them safely, and its files are read by the next command."""

import shlex
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.drafting.test_init import LOGS, drafted, write
from unmodelled.base.errors import BadInput
from unmodelled.cli.verbs.init import init
from unmodelled.drafting.lines import quoted
from unmodelled.logs.folder import read_logs
from unmodelled.logs.mapping import read_mapping
from unmodelled.systems.reader import read_system

NAMES = (
    *("a: b, {c}", "'single' and \"double\"", "# no comment", "50 % [x]", "- dash", "line\nbreak"),
    *("\x1b]0;title\x07", "\x7f\x85\u2028\ufeff", "yes", "null", "1e5", "Drehgeber \u00fc \U0001f600"),
    *("C:\\raw\\n", "*star", "&anchor", "!tag", "? key", "@at", "`mark`"),
)
UNITS = ("%", "N m", "mA", "1", "-", "kg m^2/s^2", "N·m", "°", "µm", "degC", "bar", "1/min", "m³/h", "V")


@settings(max_examples=100, deadline=None)
@given(text=st.text(st.characters(codec="utf-8"), min_size=1), unit=st.sampled_from(UNITS))
def test_any_text_is_read_back(tmp_path_factory: pytest.TempPathFactory, text: str, unit: str) -> None:
    file = tmp_path_factory.mktemp("one") / "mapping.yaml"
    signal = f"{{column: {quoted(text)}, unit: {quoted(unit)}}}"
    lines = ["schema: mapping/1", f"files: {quoted(text)}", f"signals: {{q: {signal}}}"]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    mapping = read_mapping(file)
    assert mapping.files == (text,)
    assert (mapping.signals["q"].column.name, mapping.signals["q"].unit) == (text, unit)


@pytest.mark.parametrize("quantity", ["angle", "torque", "level", "temp"])
@pytest.mark.parametrize("unit", [*UNITS, "turn", "count", "psi", "kg", "lbf", "Hz", "dB", "%RH", "foo"])
def test_whatever_the_unit_the_next_command_reads_the_files(tmp_path: Path, unit: str, quantity: str) -> None:
    """A position in kilograms is none, and is refused; everything that is written is read."""
    beside = "torque" if quantity in ("angle", "torque") else "flow"
    for k, log in enumerate(LOGS[:2]):
        columns = {"t": log["t"], beside: log["torque"]}
        if quantity == "torque":
            columns = {"t": log["t"], "angle": log["angle"]}
        own = log["torque" if quantity == "torque" else "angle"]
        pd.DataFrame({**columns, f"{quantity} [{unit}]": own}).to_parquet(tmp_path / f"{k}.parquet")
    try:
        init(tmp_path, None, None, None)
    except BadInput as refused:
        assert "no moving position and no level" in str(refused)
        assert not (tmp_path / "mapping.yaml").exists()
        return
    logs = read_logs(tmp_path, read_system(tmp_path / "system.yaml"))
    assert np.isfinite(logs.y).all() and np.isfinite(logs.u).all()


@pytest.mark.parametrize("name", NAMES)
def test_columns_with_odd_names_are_read_by_what_is_written(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for k, log in enumerate(LOGS):
        columns = {"t": log["t"], f"theta {name}": log["angle"], f"torque {name}": log["torque"]}
        pd.DataFrame(columns).to_parquet(tmp_path / f"{k}.parquet")
    _, system = drafted(tmp_path)
    logs = read_logs(tmp_path, system)
    np.testing.assert_allclose(logs.y[:, 0], np.concatenate([log["angle"] for log in LOGS]), atol=1e-12)
    assert all(line.isprintable() for line in capsys.readouterr().out.splitlines())


def test_commands_in_the_names_of_a_file_do_not_reach_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, own in (("t", "t"), ("theta \x1b]0;x\x07", "angle"), ("noise \x1b[2J", "torque")):
            file[name] = LOGS[0][own]
    init(tmp_path / "a.h5", None, None, None)
    told = capsys.readouterr().out
    assert "\x1b" not in told and r"theta \x1b]0;x\x07" in told


def test_a_file_whose_name_has_control_characters_is_left_out(tmp_path: Path) -> None:
    logs = write(tmp_path / "raw", {"t": "t", "theta": "angle", "torque": "torque"})
    (logs / "run 1.csv").rename(logs / "run\x1b[2J\n1.csv")
    _, system = drafted(logs)
    assert read_logs(logs, system).ids == ("run 0", "run 2")
    assert "(its name has a control character: rename it)" in (logs / "mapping.yaml").read_text()


def test_logs_whose_names_all_have_control_characters_are_refused(tmp_path: Path) -> None:
    logs = tmp_path / "a\nb.csv"
    pd.DataFrame(LOGS[0]).to_csv(logs, index=False)
    with pytest.raises(BadInput, match="its name has a control character: rename it") as caught:
        init(logs, None, None, None)
    assert str(caught.value).isprintable() and len(list(tmp_path.iterdir())) == 1


def test_the_next_command_can_be_pasted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logs = write(tmp_path / "day 1's (north)", {"t": "t", "theta": "angle", "torque": "torque"})
    init(logs, None, None, None)
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("next: "))
    escaped = str(logs).replace("'", "\\'")
    assert shlex.split(line)[3:] == [f"system='{escaped}/system.yaml'", f"logs='{escaped}'", "out=simulation"]


@pytest.mark.parametrize("out", ["raw", "."])
def test_the_folder_of_the_logs_may_be_named(
    tmp_path: Path, out: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path / "raw", {"t": "t", "theta": "angle", "torque": "torque"})
    monkeypatch.chdir(tmp_path if out == "raw" else tmp_path / "raw")
    init(Path(out), None, None, Path(out))
    assert (tmp_path / "raw" / "mapping.yaml").exists() and (tmp_path / "raw" / "system.yaml").exists()
