"""The whole stage graph on a tiny virtual campaign, through DVC as a user runs it."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.graph.tiny import HYBRIDS, write_project
from tests.graph.warm import warm_python
from unmodelled.base.campaign import Campaign

pytestmark = pytest.mark.graph


def path(first: Path) -> str:
    return f"{first}{os.pathsep}{os.environ['PATH']}"


def call(folder: Path, *command: str, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PATH": path(Path(sys.executable).parent), **more}
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment)


def module(folder: Path, *arguments: str, **more: str) -> str:
    result = call(folder, sys.executable, "-m", *arguments, **more)
    assert result.returncode == 0, result.stdout[-3000:] + result.stderr[-3000:]
    return result.stdout


def dvc(folder: Path, *arguments: str, **more: str) -> str:
    return module(folder, "dvc", *arguments, **more)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the checkout with a tiny campaign and profile, reproduced once.

    Its commands are forks of a process that has loaded the libraries; those of the tests below are not, and
    `test_the_same_seed_gives_the_same_numbers_as_in_the_graph` compares the two.
    """
    folder = write_project(tmp_path_factory.mktemp("project"), linked=True)
    with warm_python(folder.parent / "warm") as bin:
        dvc(folder, "repro", PATH=path(bin))
    return folder


def test_every_result_exists(project: Path) -> None:
    labels = json.loads((project / "reports/metrics/cam_labels.json").read_text())
    assert labels["data"] == "virtual"
    assert sum(labels[k]["value"] for k in ("stall", "jump", "contact")) == 40
    assert labels["table_5_1"]["cells_equal"]["value"] == 40
    chapter = json.loads((project / "reports/metrics/chapter6.json").read_text())
    models = {"f_bb", "f_h1", "f_h2", "lls", "motor", "best", "narx", "rnn", "gp"}
    assert set(chapter["interpolation"]) == models == set(chapter["f_min"]) - {"direct"}
    assert set(chapter["extrapolation"]) == {str(k) for k in range(1, 9)} == set(chapter["boundary"])
    assert set(chapter["boundary"]["1"]) == models | {"direct"}
    chapter = json.loads((project / "reports/metrics/chapter4.json").read_text())
    assert set(chapter["loocv"]) == set(HYBRIDS) and set(chapter["recurrent"]) == {"1", "10"}
    assert set(chapter["parameters"]) == {"m3", "J1", "B_m"}
    assert "rmse_share" in chapter["recovered"]["spring"] and chapter["identifiability"]["advice"]["text"]
    chapter = json.loads((project / "reports/metrics/chapter3.json").read_text())
    methods = {"gaussian", "maximum_entropy", "push_forward"}
    assert set(chapter["emd"]) == methods == set(chapter["identification"])
    assert {"coefficients", "moments", "emd"} == set(chapter["example"]) and chapter["push_forward"]["error"]
    chapter = json.loads((project / "reports/metrics/chapter5.json").read_text())
    features = {"tau1", "tau2", "tau3", "tau4"}
    assert all(features <= set(chapter["uniform"][percent]) for percent in ("1", "5", "10", "30", "50"))
    assert all(features <= set(chapter["split"][factor]) for factor in ("H", "beta", "m"))
    assert set(chapter["attribution"]["share"]) == features
    assert chapter["baseline"]["bounce"]["accuracy"] and chapter["hybrid"]["accuracy"]
    withheld = json.loads((project / "reports/metrics/withheld.json").read_text())
    assert withheld["null"]["correct"]["n"] == 1 and set(withheld["systems"]) == {"hoist"}
    claims = json.loads((project / "reports/claims.json").read_text())
    assert {row["chapter"] for row in claims} == {2, 3, 4, 5, 6}
    page = (project / "reports/index.html").read_text()
    assert "simulated logs, not measurements" in page


def test_every_configured_figure_is_drawn(project: Path) -> None:
    index = json.loads((project / "reports/figures/figures.json").read_text())
    assert len(index) >= 40
    for entry in index:
        assert (project / "reports/figures" / f"{entry['id']}.svg").stat().st_size > 2000
        assert entry["caption"].endswith("."), entry["id"]


def test_a_second_repro_does_nothing(project: Path) -> None:
    assert "Data and pipelines are up to date" in dvc(project, "repro")


def test_editing_one_model_touches_only_its_cells(project: Path) -> None:
    config = project / "conf/model/f_h1.yaml"
    before = config.read_text()
    try:
        config.write_text(before.replace("batch: 200", "batch: 100"))
        dvc(project, "repro", "code")
        changed = {stage.rpartition(":")[2] for stage in json.loads(dvc(project, "status", "--json"))}
    finally:
        config.write_text(before)
        dvc(project, "repro", "code")
    assert changed == {"train@f_h1-interpolation", "train@f_h1-extrapolation", "tune@f_h1", "evaluate"}


def test_a_sweep_touches_nothing_that_the_graph_tracks(project: Path) -> None:
    before = {path.name for path in project.iterdir()}
    sweep = ["-m", "model=f_h1,f_h2", "seed=range(2)", "split=tuning", "profile=quick"]
    result = call(project, sys.executable, "-m", "pipeline", "train", *sweep, EXP_LAUNCHER="joblib")
    assert result.returncode == 0, result.stderr
    assert len(list((project / "outputs/train").glob("*/*/model.pt"))) == 4
    assert json.loads(dvc(project, "status", "--json")) == {}
    assert {path.name for path in project.iterdir()} - before <= {"outputs"}


def test_the_same_seed_gives_the_same_numbers_as_in_the_graph(project: Path) -> None:
    place = "cam_follower/f_h2/interpolation"
    for command in (
        ["train", "profile=quick", "out=outputs/fit"],
        ["evaluate", "fits=outputs/fit", "out=outputs/prediction"],
    ):
        cell = [*command, "model=f_h2", "split=interpolation"]
        result = call(project, sys.executable, "-m", "pipeline", *cell)
        assert result.returncode == 0, result.stderr
    again = (project / "outputs/prediction/errors.parquet").read_bytes()
    assert (project / "data/predictions" / place / "errors.parquet").read_bytes() == again


@pytest.mark.parametrize("delay", [0.4, 0.8, 1.2, 1.6])
def test_a_killed_stage_leaves_all_or_nothing_and_a_rerun_completes(delay: float, project: Path) -> None:
    store = project / f"outputs/killed_{delay}"
    command = [sys.executable, "-m", "pipeline", "ingest", f"out={store}"]
    process = subprocess.Popen(command, cwd=project, start_new_session=True, stderr=subprocess.DEVNULL)
    try:
        process.wait(timeout=delay)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    if store.exists():
        assert len(Campaign.read(store)) == 40
    assert call(project, *command).returncode == 0
    assert len(Campaign.read(store)) == 40
