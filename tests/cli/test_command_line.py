"""What a user sees: help, errors, exit codes."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.__main__ import CONF, PROGRAM, main
from tests.commands import exit_code, python
from tests.conftest import log_text, write_archive
from unmodelled.base.markers import MARKER

ROOT = CONF.parent
#: Exit code, standard output and standard error of a command.
Said = tuple[int, str, str]
Run = Callable[..., Said]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """A command in this process, because loading the libraries takes longer than most commands."""

    def call(*arguments: str, **environment: str) -> Said:
        monkeypatch.chdir(ROOT)
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        code, said = exit_code(*arguments), capsys.readouterr()
        return code, said.out, said.err

    return call


def assert_refused(result: Said, *words: str) -> None:
    code, _, said = result
    assert code == 2, said
    lines = said.strip().splitlines()
    assert len(lines) == 1, said
    for word in words:
        assert word in lines[0]


def test_help_lists_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    printed = capsys.readouterr().out
    for verb in PROGRAM.verbs:
        assert f"  {verb} " in printed


def test_help_imports_nothing_heavy() -> None:
    code = "import sys; from pipeline.__main__ import main; main(['--help']); print(sorted(sys.modules))"
    printed = python("-c", code).stdout
    for heavy in ("torch", "numba", "shap", "matplotlib", "scipy", "pandas", "hydra"):
        assert f"'{heavy}'" not in printed


@pytest.mark.parametrize("verb", PROGRAM.verbs)
def test_help_of_a_verb_explains_its_arguments(verb: str, run: Run) -> None:
    code, said, wrong = run(verb, "--help")
    assert code == 0, wrong
    assert "Args:" in said
    assert f"_target_: {PROGRAM.target(verb)}" in said


@pytest.mark.parametrize(
    ("words", "data_set", "said"),
    [
        ("train model=f_h2 model.features={0}/none", "", ("none", "no such file")),
        ("acquire source=measured", "{0}/absent.zip", ("absent.zip",)),
        ("acquire -q source=measured source.url={0}/nowhere", "", ("nowhere", "cannot be fetched")),
    ],
)
def test_data_that_are_not_there(
    words: str, data_set: str, said: tuple[str, ...], tmp_path: Path, run: Run
) -> None:
    given = words.format(tmp_path).split()
    assert_refused(run(*given, f"out={tmp_path}/out", DATASET=data_set.format(tmp_path)), *said)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [["compare", "runs="], ["simulate", "system=a", "logs=b", "out="]])
def test_a_name_that_no_file_can_have(arguments: list[str], run: Run) -> None:
    *others, last = arguments
    assert_refused(run(*others, last + 5000 * "x"), last[:-1], "too long")


@pytest.mark.long
@pytest.mark.parametrize("kind", ["folder", "zip"])
def test_measured_from_folder_or_zip(kind: str, tmp_path: Path, run: Run) -> None:
    source = write_archive(tmp_path / "set.zip", {1: log_text(), 2: log_text(rate=9.0)})
    if kind == "folder":
        shutil.unpack_archive(source, tmp_path / "unpacked")
        source = tmp_path / "unpacked"
    code, _, said = run("acquire", "source=measured", f"out={tmp_path}/raw", DATASET=str(source))
    assert code == 0, said
    code, _, said = run("ingest", f"raw={tmp_path}/raw", f"out={tmp_path}/store")
    assert code == 0, said
    assert (tmp_path / "store" / "signals.parquet").exists()


def test_a_bad_log_leaves_the_old_store_alone(tmp_path: Path, run: Run) -> None:
    rows = log_text()
    rows[2][7] = "oops"
    raw, store = tmp_path / "raw", tmp_path / "store"
    raw.mkdir()
    (raw / "provenance.json").write_text('{"data": "virtual"}')
    write_archive(raw / "campaign.zip", {1: log_text(), 2: rows})
    store.mkdir()
    (store / "signals.parquet").write_text("old")
    (store / MARKER).write_text('{"made_by": "ingest", "files": ["signals.parquet"]}')
    assert_refused(
        run("ingest", f"raw={raw}", f"out={store}"), "exp2.csv", "row 3 (omega) column 8", "'oops'"
    )
    assert [p.name for p in tmp_path.iterdir() if p.name.endswith(".tmp")] == []
    assert (store / "signals.parquet").read_text() == "old"


def test_what_a_killed_evaluation_left_behind_is_not_a_prediction(tmp_path: Path) -> None:
    import pandas as pd

    from pipeline.stages.tabulate import _gather

    for split in ("interpolation", ".interpolation.77.tmp"):
        folder = tmp_path / "motor" / split
        folder.mkdir(parents=True)
        pd.DataFrame({"exp": [1]}).to_parquet(folder / "errors.parquet")
    assert _gather(tmp_path, "errors")["split"].tolist() == ["interpolation"]
