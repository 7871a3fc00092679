"""A stage is run again when code or configuration that it runs has changed, and at no other change."""

import contextlib
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from pipeline import digests as stage
from pipeline.__main__ import PROGRAM
from tests.commands import python
from tests.conftest import stages

pytestmark = pytest.mark.long

Changed = Callable[..., set[str]]

ROOT = Path(__file__).parents[2]
DIAGNOSING = {"audit", "diagnose", "diagnose_systems", "diagnose_withheld", "next", "plan"}
DIAGNOSING |= {"propose_withheld", "refit_withheld"}


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the program and its configuration."""
    folder = tmp_path_factory.mktemp("checkout")
    for name in ("unmodelled", "pipeline", "conf"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "params.yaml", folder)
    return folder


def digests(checkout: Path) -> dict[str, str]:
    by_name = (stage.source, stage.tree, stage.imported, stage.code_digest, stage.data_files)
    for cached in (*by_name, stage.configuration):
        cached.cache_clear()
    with contextlib.chdir(checkout):
        stage.main()
    return written(checkout)


def written(checkout: Path) -> dict[str, str]:
    out = checkout / "data" / "digests"
    return {
        path.relative_to(out).with_suffix("").as_posix(): path.read_text() for path in out.rglob("*.json")
    }


@pytest.fixture(scope="module")
def before(checkout: Path) -> dict[str, str]:
    """Digests that the command writes; the tests below compare those that this process writes, which parses
    unchanged files only once."""
    command = [sys.executable, "-m", "pipeline.digests"]
    subprocess.run(command, cwd=checkout, check=True, env={"PYTHONPATH": str(checkout)})
    return written(checkout)


@pytest.fixture
def changed(checkout: Path, before: dict[str, str]) -> Changed:
    """Names of the digests that differ after text was added to files, which are put right again."""

    def change(*added: tuple[str, str]) -> set[str]:
        paths = [checkout / file for file, _ in added]
        texts = {path: path.read_text() if path.exists() else None for path in paths}
        try:
            for path, (_, more) in zip(paths, added, strict=True):
                path.write_text((texts[path] or "") + more)
            after = digests(checkout)
        finally:
            for path, text in texts.items():
                path.unlink() if text is None else path.write_text(text)
        assert set(after) == set(before)
        return {name for name in after if after[name] != before[name]}

    return change


def test_comments_docstrings_and_layout_change_nothing(changed: Changed) -> None:
    assert not changed(
        ("unmodelled/engine/resample.py", "\n\n# why\n"),
        ("unmodelled/base/errors.py", '\n\n"""Said of the module."""\n'),
        ("conf/model/f_h1.yaml", "\n# a comment\n"),
    )


def test_a_docstring_of_a_figure_is_its_caption(checkout: Path, before: dict[str, str]) -> None:
    path = checkout / "pipeline" / "figures" / "cams.py"
    text = path.read_text()
    path.write_text(re.sub(r'(def cam_shapes[^\n]*\n    """)', r"\1Other words. ", text))
    after = digests(checkout)
    path.write_text(text)
    assert {name for name in after if after[name] != before[name]} == {"draw"}


def test_a_new_law_concerns_diagnoses_alone(changed: Changed) -> None:
    assert changed(("unmodelled/effects/another_law.py", "FACTOR = 1.0\n")) == DIAGNOSING


def test_a_style_sheet_and_a_template_concern_pages_alone(changed: Changed) -> None:
    pages = {"site", "audit", "diagnose", "identify_uncertainty", "next", "report", "simulate"}
    assert changed(("unmodelled/report/static/style.css", "p {color: red}")) == pages
    assert changed(("pipeline/report/templates/home.html.j2", " ")) == {"site"}


def test_a_config_file_concerns_what_is_built_on_it(changed: Changed) -> None:
    assert changed(("conf/model/f_h1.yaml", "more: 1\n")) == {"model/f_h1", "lists/models", "lists/tuned"}
    sequences = changed(("conf/training/sequence.yaml", "more: 1\n"))
    assert {"training/sequence", "model/tau1", "model/detachment", "lists/jumps"} <= sequences
    assert "model/f_h1" not in sequences and "model/nnap" not in sequences


def test_code_that_a_config_file_names_is_part_of_it(changed: Changed) -> None:
    rig = changed(("pipeline/rigs/clutch_rig.py", "FACTOR = 1.0\n"))
    assert rig == {"source/clutch", "source/clutch_sharp", "lists/campaigns"}


#: Says which modules of the program are loaded once a verb has been run.
RUN = """
import json, sys
from pipeline.__main__ import main
try:
    code = main(sys.argv[1:])
except SystemExit as end:
    code = end.code
found = sorted(n for n in sys.modules if n.split(".")[0] in ("unmodelled", "pipeline"))
print("\\n" + json.dumps([code, found]))
"""


@pytest.mark.parametrize(
    ("words", "configs"),
    [
        (["acquire", "source=slider_crank"], ["source/slider_crank"]),
        (["simulate", "system=systems/pendulum.yaml", "logs={logs}"], []),
        (["diagnose", "system=systems/pendulum.yaml", "logs={logs}"], []),
        (["ingest", "system=systems/pendulum.yaml", "raw={logs}"], ["mechanism/cam_follower"]),
        (
            ["train", "system=systems/pendulum.yaml", "logs={logs}", "model=hybrid", "split=leave_one_out"],
            ["model/hybrid", "split/leave_one_out", "profile/quick"],
        ),
    ],
)
def test_what_a_verb_loads_is_part_of_its_digests(
    words: list[str], configs: list[str], before: dict[str, str], frame: set[str], logs: Path, tmp_path: Path
) -> None:
    command = [word.format(logs=logs) for word in words]
    more = ["profile=quick", "profile.window_epochs=1"] if words[0] == "train" else []
    code, loaded = run(*command, *more, f"out={tmp_path / 'out'}")
    known = {module for name in (words[0], *configs) for module in json.loads(before[name])["code"]}
    if words[0] == "train":
        known |= _pages()  # they show a fit and decide nothing of it
    assert code == 0 and any(name.endswith(f".{words[0]}") for name in loaded)
    assert not loaded - frame - known


def _pages() -> set[str]:
    """Modules that write down what a fit has learned, and those that these need."""
    pages = ["api.learned_laws", "report.result_pages", "report.figures.results"]
    pages = [f"unmodelled.{name}" for name in pages]
    code = f"import sys, {', '.join(pages)}; print(*sys.modules)"
    return {name for name in python("-c", code).stdout.split() if name.split(".")[0] == "unmodelled"}


def run(*words: str) -> tuple[int, set[str]]:
    """Exit code and modules of a command in a process of its own."""
    code, loaded = json.loads(python("-c", RUN, *words).stdout.splitlines()[-1])
    return code, set(loaded)


@pytest.fixture(scope="module")
def frame() -> set[str]:
    """What the command line loads around a verb: of one that is refused, and to note one that is done."""
    code, loaded = run("simulate", "no_such_key=1")
    assert code == 2 and not any(".verbs." in name or ".stages." in name for name in loaded)
    return loaded | {"pipeline.revision"}


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs") / "pendulum"
    assert python("-m", "pipeline", "acquire", "source=pendulum", f"out={folder}").returncode == 0
    return folder


def declared(stage: dict[str, Any]) -> tuple[list[str], list[str]]:
    """Words of a stage's command, and its dependencies."""
    stage = stage.get("do", stage)
    return stage["cmd"].split(), [str(d) for d in stage["deps"]]


@pytest.mark.parametrize("name", [name for name in stages() if name != "code"])
def test_a_stage_depends_on_the_digests_of_its_verbs_and_choices(name: str) -> None:
    words, deps = declared(stages()[name])
    for command in " ".join(words).split("python -m pipeline")[1].removeprefix(".cells").split(" + "):
        verb, *keys = command.split()
        needed = {verb}
        given = dict(key.split("=", 1) for key in keys)
        for entry in yaml.safe_load(PROGRAM.config(verb).read_text()).get("defaults", []):
            for group, choice in entry.items() if isinstance(entry, dict) else ():
                chosen = given.get(group, choice)
                needed.add(f"lists/{chosen[1:]}" if chosen.startswith("@") else f"{group}/{chosen}")
        needed |= {f"lists/{value[1:]}" for value in given.values() if value.startswith("@")}
        assert {f"data/digests/{digest}.json" for digest in needed} <= set(deps)


def test_no_dependency_on_code_is_written_by_hand() -> None:
    for name, found in stages().items():
        assert name == "code" or not [
            d for d in declared(found)[1] if d.startswith(("unmodelled", "pipeline", "conf"))
        ]
