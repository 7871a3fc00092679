"""What the pages of the documentation promise exists: links, commands, files, imports, what is printed."""

import ast
import gzip
import importlib
import re
import shlex
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pipeline.__main__ import CONF, PROGRAM, main
from pipeline.rigs.pendulum import PendulumCampaign
from pipeline.stages.acquire import acquire
from tests.commands import python
from unmodelled.__main__ import PROGRAM as LIBRARY
from unmodelled.cli.verbs.simulate import simulate
from unmodelled.effects.law_files import read_laws
from unmodelled.logs.mapping import read_mapping
from unmodelled.systems.reader import read_system

ROOT = CONF.parent
PROGRAMS = {"python -m pipeline": PROGRAM, "unmodelled": LIBRARY}
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s]+)\)")


def name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def blocks(path: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", path.read_text(), re.S | re.M)


def anchors(path: Path) -> set[str]:
    """As GitHub makes them of headings."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```", "", path.read_text(), flags=re.S | re.M), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def commands() -> list[tuple[str, str]]:
    """Program, and verb with keys, of all commands that are complete as they stand."""
    lines = [line for page in PAGES for text in blocks(page, "sh") for line in text.splitlines()]
    found = [
        (p, line.split(" # ")[0].strip()) for p in PROGRAMS for line in lines if line.startswith(f"{p} ")
    ]
    calls = {(program, line.removeprefix(program).strip()) for program, line in found}
    return sorted((p, call) for p, call in calls if not re.search(r"\.\.\.|<|\$|--|-m |\\$", call))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in LINK.findall(page.read_text()):
        if re.match(r"\w+:", target):
            continue
        file, _, anchor = target.partition("#")
        found = (page.parent / file).resolve() if file else page
        assert found.exists(), target
        assert not anchor or anchor in anchors(found), target


@pytest.mark.parametrize(("program", "call"), commands())
def test_commands_have_a_configuration(program: str, call: str) -> None:
    verb, *rest = shlex.split(call)
    assert verb in PROGRAMS[program].verbs
    overrides = [word for word in rest if "=" in word]
    assert PROGRAMS[program].compose(verb, overrides)["_target_"] == PROGRAMS[program].target(verb)


#: Robots with the joints that the pages name, for their system files.
ROBOT = """<robot name="double_pendulum"><link name="base"/>
<joint name="Joint1" type="continuous"><parent link="base"/><child link="Link1"/><axis xyz="1 0 0"/></joint>
<link name="Link1"><inertial><origin xyz="0 0 -0.3"/><mass value="0.6"/>
<inertia ixx="0.05" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="Joint2" type="continuous"><parent link="Link1"/><child link="Link2"/><axis xyz="1 0 0"/></joint>
<link name="Link2"><inertial><origin xyz="0 0 -0.2"/><mass value="0.6"/>
<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""
ROBOTS = {
    "double_pendulum.urdf": ROBOT,
    # of the six joints, the page shows one
    "ur10e.urdf": ROBOT.split('<joint name="Joint2"')[0].replace("Joint1", "shoulder_pan_joint") + "</robot>",
}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_system_files_can_be_read(page: Path, tmp_path: Path) -> None:
    for text in blocks(page, "yaml"):
        if text.startswith("schema: mapping/"):
            (tmp_path / "mapping.yaml").write_text(text)
            assert read_mapping(tmp_path / "mapping.yaml").signals
        elif text.startswith("schema: laws/"):
            (tmp_path / "laws.yaml").write_text(text)
            assert read_laws(tmp_path / "laws.yaml")
        elif text.startswith("schema:"):
            for file in re.findall(r"^model: (\S+)$", text, re.MULTILINE):
                (tmp_path / file).write_text(ROBOTS[file])
            (tmp_path / "system.yaml").write_text(text)
            assert read_system(tmp_path / "system.yaml").states


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_what_python_code_imports_exists(page: Path) -> None:
    for text in blocks(page, "python"):
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.module:
                module = importlib.import_module(node.module)
                assert all(hasattr(module, alias.name) for alias in node.names), node.module


def test_the_tutorial_prints_what_it_shows(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    acquire(PendulumCampaign(), 0, tmp_path / "logs")
    simulate(ROOT / "systems" / "pendulum.yaml", tmp_path / "logs", None, tmp_path / "known")
    said = capsys.readouterr().out.strip()
    shown = (ROOT / "docs" / "tutorial" / "README.md").read_text()
    assert said in shown
    head = (tmp_path / "logs" / "run1.csv").read_text().splitlines()[:3]
    assert all(line in shown for line in head)


def test_the_tutorial_shows_what_was_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    shown = (ROOT / "docs" / "tutorial" / "README.md").read_text()
    assert main(["acquire", "source=pendulum", "out=outputs/pendulum/logs"]) == 0
    said = capsys.readouterr().err.strip()
    assert said.startswith("wrote ") and said in shown


@pytest.fixture(scope="module")
def newcomer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the pendulum's system file and logs."""
    folder = tmp_path_factory.mktemp("newcomer")
    shutil.copy(ROOT / "systems" / "pendulum.yaml", folder)
    acquire(PendulumCampaign(), 0, folder / "logs")
    return folder


@pytest.mark.long
@pytest.mark.parametrize("page", ["README.md", "docs/own_data/README.md"])
def test_python_examples_print_what_they_show(page: str, newcomer: Path) -> None:
    """The training, which takes a minute, is left out: the notebooks run one."""
    code = next(text for text in blocks(ROOT / page, "python") if text.startswith("import unmodelled"))
    result = python("-c", code, cwd=newcomer)
    assert result.returncode == 0, result.stderr
    said, shown = result.stdout.splitlines(), (ROOT / page).read_text()
    assert said and all(line in shown for line in said[:3])


def test_a_log_folder_is_refused_as_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The faults of docs/own_data, made in a folder."""
    monkeypatch.chdir(tmp_path)
    acquire(PendulumCampaign(), 0, Path("mylogs"))
    one, two, three, four, five, six = (Path("mylogs") / f"run{number}.csv" for number in range(1, 7))
    one.write_text(one.read_text().replace(",", ";").replace(".", ","))
    two.write_text(two.read_text().replace("theta", "Theta [rad]"))
    rows = three.read_text().splitlines()
    three.write_text("\n".join([*rows[:2], "0.002,abc,0.1", *rows[3:]]))
    rows = four.read_text().splitlines()
    four.write_text("\n".join([*rows[:11], *rows[10:]]))
    five.write_bytes(gzip.compress(five.read_bytes()))
    six.rename("mylogs/run_6.csv")
    with pytest.raises(SystemExit) as left:
        main(["simulate", f"system={ROOT}/systems/pendulum.yaml", "logs=mylogs", "out=x"])
    assert left.value.code == 2
    assert capsys.readouterr().err in (ROOT / "docs" / "own_data" / "README.md").read_text()


@pytest.mark.long
def test_a_recorders_files_lead_to_a_simulation_as_shown(
    newcomer: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The logs of the pendulum as another recorder writes them, and the two commands of docs/own_data."""
    monkeypatch.chdir(tmp_path)
    Path("recordings").mkdir()
    for log in sorted((newcomer / "logs").glob("run*.csv")):
        t, torque, theta = pd.read_csv(log)[["t", "torque", "theta"]].to_numpy().T
        table = pd.DataFrame({"Zeit [ms]": 1e3 * t, "Winkel [deg]": np.rad2deg(theta), "Moment": torque})
        table.round(6).to_csv(Path("recordings") / log.name, sep=";", decimal=",", index=False)
    shown = (ROOT / "docs" / "own_data" / "README.md").read_text()
    assert "\n".join(Path("recordings/run1.csv").read_text().splitlines()[:3]) in shown
    page = [
        line for text in blocks(ROOT / "docs" / "own_data" / "README.md", "sh") for line in text.splitlines()
    ]
    first, second, _ = (line.split(" # ")[0].split() for line in page if "recordings" in line)
    assert main(first[1:]) == 0
    assert capsys.readouterr().out in shown
    assert main(second[1:]) == 0


def test_every_page_is_in_the_index() -> None:
    index = (ROOT / "docs" / "README.md").read_text()
    folders = {p.relative_to(ROOT / "docs").as_posix() for p in (ROOT / "docs").glob("*/README.md")}
    decisions = {p.relative_to(ROOT / "docs").as_posix() for p in (ROOT / "docs" / "decisions").glob("*.md")}
    assert folders | decisions <= set(LINK.findall(index))
