"""A verb that is ended at any moment leaves the whole old folder or the whole new one."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from hydra.utils import get_method

from tests.cli.killed import call
from tests.commands import ROOT, python
from unmodelled.__main__ import PROGRAM
from unmodelled.base.ownership import Out
from unmodelled.base.workers import INTERRUPTION

EXAMPLES = ROOT / "unmodelled" / "api" / "examples"
MOMENTS = 20
CODES = {"SIGKILL": (-9,), "SIGINT": (130, 0), "SIGTERM": (143, 0)}
LIMITS = """
duration: 1
period: 0.01
inputs: {torque: {low: -0.5, high: 0.5, rate: 5}}
travel: {theta: {low: -1.0, high: 1.0}}
noise: {theta: 0.0005}
"""

PENDULUM = ["system=pendulum/pendulum.yaml", "logs=pendulum/logs"]
TINY = ["profile=quick", "++profile.epochs=2", "++profile.system_repeats=1"]
SEARCH = ["profile.data_sets=2", "uncertainty.search.generations=3", "uncertainty.nodes=[9]", "workers=1"]
FLYWHEEL = ["system=flywheel/flywheel.yaml", "logs=flywheel/logs", *SEARCH]
#: Words of every verb, those of its old result, and those of the new one.
VERBS: dict[str, tuple[list[str], list[str], list[str]]] = {
    "simulate": (PENDULUM, ["horizon=0.1"], ["horizon=0.2"]),
    "identifiability": (PENDULUM, ["limit=5"], ["limit=20"]),
    "identify_uncertainty": (FLYWHEEL, ["seed=0"], ["seed=1"]),
    "train": ([*PENDULUM, *TINY], ["seed=0"], ["seed=1"]),
    "evaluate": (PENDULUM, ["fits=fits0"], ["fits=fits1"]),
    "compare": (["runs=sweep"], ["metric=simulation.gap.known"], ["metric=simulation.gap.floor"]),
    "diagnose": (PENDULUM, ["seed=0"], ["seed=1"]),
    "audit": ([*PENDULUM, "sets=[tuned.yaml]"], ["horizon=0.1"], ["horizon=0.2"]),
    "plan": (["system=pendulum/pendulum.yaml", "limits=limits.yaml"], ["seed=0"], ["seed=1"]),
    "example": ([], ["name=pendulum"], ["name=flywheel"]),
    "next": (["answer=answer", "limits=limits.yaml", *PENDULUM], ["seed=0"], ["seed=1"]),
}


def test_all_verbs_that_write_a_folder_are_ended() -> None:
    kinds = {verb: get_method(PROGRAM.target(verb)).__dict__["place"].out for verb in PROGRAM.verbs}
    assert {verb for verb, kind in kinds.items() if kind is Out.FOLDER} == {*VERBS}


@pytest.fixture
def place(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with what the verb needs, in which its folder of results has room."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("EXP_PROGRESS", "quiet")
    for name in ("pendulum", "flywheel"):
        shutil.copytree(EXAMPLES / name, tmp_path / name)
    (tmp_path / "limits.yaml").write_text(LIMITS)
    (tmp_path / "tuned.yaml").write_text("b: 0.0254\n")
    if request.param == "evaluate":
        for seed in (0, 1):
            assert call(["train", *PENDULUM, *TINY, f"seed={seed}", f"out=fits{seed}"]) == 0
    elif request.param == "compare":
        assert call(["simulate", *PENDULUM, "-m", "horizon=0.1,0.2", "hydra.sweep.dir=sweep"]) == 0
    elif request.param == "next":
        assert call(["diagnose", *PENDULUM, "out=answer"]) == 0
    (tmp_path / "results").mkdir()
    return tmp_path / "results"


@pytest.mark.long
@pytest.mark.parametrize(("verb", "place"), [(verb, verb) for verb in VERBS], indirect=["place"])
def test_the_old_result_or_the_new_one_is_whole(verb: str, place: Path) -> None:
    words, *both = VERBS[verb]
    old, new = (json.dumps([verb, *words, *own]) for own in both)
    done = python("-m", "tests.cli.killed", place, str(MOMENTS), old, new, cwd=place.parent)
    assert done.returncode == 0, done.stdout + done.stderr
    said: dict[str, Any] = json.loads(done.stdout)
    assert not said["equal"] and {found["is"] for found in said["found"]} == {"old", "new"}
    assert said["operations"] >= 5 and len(said["found"]) == MOMENTS
    for found in said["found"]:
        assert found["code"] in CODES[found["signal"]], found
        if found["signal"] != "SIGKILL":
            assert found["beside"] == ["out"] and "Traceback" not in found["said"], found
            assert found["said"].count(INTERRUPTION) == (found["code"] != 0), found
