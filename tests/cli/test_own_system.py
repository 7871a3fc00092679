"""What the README tells a newcomer to do with a pendulum: its commands, with a shorter training."""

import json
import re
import shlex
from pathlib import Path

import pandas as pd
import pytest

from tests.commands import ROOT, python

pytestmark = pytest.mark.long

SECTION = (ROOT / "README.md").read_text().partition("## Your own machine")[2].partition("\n## ")[0]
SYSTEM = re.search(r"```yaml\n(.*?)```", SECTION, re.S)
COMMANDS = "".join(re.findall(r"```sh\n(.*?)```", SECTION, re.S))
#: Keys that are added to the command of a verb: a training of a quarter of the length is accurate enough.
SHORTER = {"train": ["profile.window_epochs=25"]}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a newcomer has run every command of the README."""
    assert SYSTEM and COMMANDS
    here = tmp_path_factory.mktemp("newcomer")
    (here / "pendulum.yaml").write_text(SYSTEM[1])
    said = ""
    for line in COMMANDS.splitlines():
        words = shlex.split(line, comments=True)
        words += [key for verb, keys in SHORTER.items() if verb in words for key in keys]
        result = python(*(["-m", *words] if words[0] == "unmodelled" else words[1:]), cwd=here)
        assert result.returncode == 0, (line, result.stderr)
        said += result.stdout
    (here / "said").write_text(said)
    return here


def test_the_known_physics_is_off_and_the_hybrid_model_is_not(folder: Path) -> None:
    gap = json.loads((folder / "simulation" / "simulation.json").read_text())["gap"]
    assert gap["known"] > 10 * gap["floor"]
    errors = pd.read_parquet(folder / "predictions" / "errors.parquet")
    assert errors.groupby("state")["rmse"].median()["omega"] < 0.05
    assert not errors["diverged"].any()


def test_a_human_is_told(folder: Path) -> None:
    said = (folder / "said").read_text()
    for words in ("gap:", "b is absorbed by the network", "N m s/rad", "omega: held-out free-run RMSE"):
        assert words in said


def test_nothing_is_left_beside_the_results(folder: Path) -> None:
    names = {p.name for p in folder.iterdir()}
    results = {"answer", "simulation", "advice", "fit", "predictions"}
    assert names == {"pendulum.yaml", "logs", "said"} | results
