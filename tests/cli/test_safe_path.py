"""Nothing that lies in the working folder is executed, in this process or in those that it starts."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.commands import ROOT, python
from tests.conftest import files_of
from unmodelled.__main__ import PROGRAM, SETTINGS

#: A program as `pip` installs it, which calls several verbs.
SCRIPT = """
import json, sys
from unmodelled.__main__ import PROGRAM, SETTINGS
from unmodelled.cli.command_line import main

if __name__ == "__main__":
    for words in json.loads(sys.argv[1]):
        try:
            code = main(PROGRAM, words)
        except SystemExit as left:
            code = left.code
        print(words[0], code)
"""
#: Words of a verb that reads logs and then ends.
READS = ("system=../draft/system.yaml", "logs=../draft")
#: Keys that a verb needs besides; what does not exist is refused after the logs were read, or at once.
MORE = {
    "init": ("logs=../a.npz", "out=../draft"),
    "diagnose": (*READS, "out=../answer", "horizon=1000"),
    "simulate": (*READS, "out=../run"),
    "identifiability": (*READS, "out=../study", "parameters=[none]"),
    "identify_uncertainty": (*READS, "out=../distribution", "event=none"),
    "train": (*READS, "out=../fit", "device=none"),
    "evaluate": (*READS, "out=../judged", "fits=../none"),
    "next": (*READS, "out=../proposal", "answer=../none", "limits=../none"),
    "audit": (*READS, "out=../audit", "parameters=[none]"),
    "plan": ("system=../draft/system.yaml", "out=../plan", "limits=../none"),
    "export": ("system=../draft/system.yaml", "out=../machine.fmu"),
    "compare": ("runs=..", "out=../table"),
    "report": ("answers=..", "out=../page"),
    "example": ("name=none", "out=../example"),
}
#: Modules that Python or a tool imports if it finds them, and one of a library.
HOOKS = ("sitecustomize", "usercustomize", "conftest", "setup", "numpy")
#: Files that tools read from the folder in which they are started; none of them is read.
EVIL = "_target_: conftest.main\nhydra: {run: {dir: ran}}\n"
LEFT = {
    **{
        f"{place}{name}.yaml": EVIL
        for place in ("", "conf/", ".hydra/")
        for name in ("config", "init", "export")
    },
    "conf/hydra/launcher/joblib.yaml": EVIL,
    ".env": "PYTHONSTARTUP=conftest.py\nEXP_LAUNCHER=slurm\n",
    "pyproject.toml": "\0",
    "pyvenv.cfg": "home = /nowhere\n",
    "__pycache__/conftest.cpython-311.pyc": "\0",
}


def hostile(folder: Path) -> Path:
    """A folder with a module of every name of the standard library, which says that it was executed."""
    folder.mkdir()
    told = f"open({str(folder / 'executed')!r}, 'a').write(__name__ + ' ')\nraise ImportError(__name__)\n"
    packages = ("hydra_plugins/evil", "unmodelled", "numba", "torch")
    for name in {*sys.stdlib_module_names, *HOOKS, *(f"{package}/__init__" for package in packages)}:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.py").write_text(told)
    (folder / "evil.pth").write_text("import " + HOOKS[0])
    for name, content in LEFT.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    return folder


def recorded(folder: Path) -> Path:
    """A recording in a format that a process of its own reads."""
    t = np.arange(400) * 0.01
    np.savez(folder / "a.npz", t=t, theta=np.sin(t), u=np.cos(3.0 * t))
    return folder


def test_no_verb_executes_a_file_of_the_working_folder(tmp_path: Path) -> None:
    assert {*MORE} == {*PROGRAM.verbs}
    here = hostile(recorded(tmp_path) / "here")
    before = files_of(here)
    (script := tmp_path / "program.py").write_text(SCRIPT)
    commands = json.dumps([[verb, *words, "-q"] for verb, words in MORE.items()])
    done = python(script, commands, cwd=here, PYTHONPATH=str(ROOT), PYTHONSAFEPATH=None)
    codes = dict(line.split() for line in done.stdout.splitlines() if line.partition(" ")[0] in MORE)
    assert codes.keys() == MORE.keys() and codes["init"] == codes["simulate"] == "0", done.stderr
    assert {*codes.values()} <= {"0", "2"} and "Traceback" not in done.stderr, done.stderr
    assert not (here / "executed").exists(), (here / "executed").read_text()
    assert files_of(here) == before


@pytest.mark.long
def test_no_sweep_executes_a_file_of_the_working_folder(tmp_path: Path) -> None:
    here = hostile(recorded(tmp_path) / "here")
    (script := tmp_path / "program.py").write_text("from unmodelled.__main__ import console\nconsole()\n")
    words = ("init", "-m", "logs=../a.npz", "robot=../none,../neither")
    more = {"PYTHONPATH": str(ROOT), "PYTHONSAFEPATH": None, "EXP_LAUNCHER": "joblib"}
    done = python(script, *words, cwd=here, **more)
    assert done.returncode == 2 and "Done   2 out of   2" in done.stderr, done.stderr
    assert not (here / "executed").exists(), (here / "executed").read_text()


@pytest.mark.parametrize(
    "content", [b"\xff\xfe\x00", b"backend: module://antigravity\nsvg.image_inline: False\n"]
)
def test_no_verb_reads_settings_of_the_working_folder(tmp_path: Path, content: bytes) -> None:
    """Matplotlib and numba read such files while they are imported."""
    recorded(tmp_path)
    (here := tmp_path / "here").mkdir()
    for name in SETTINGS:
        (here / name).write_bytes(content)
    (script := tmp_path / "program.py").write_text("from unmodelled.__main__ import console\nconsole()\n")
    told = (
        python(script, verb, *words, cwd=here) for verb, words in ((v, MORE[v]) for v in ("next", "compare"))
    )
    assert [(done.returncode, done.stderr.count("\n")) for done in told] == [(2, 1)] * 2


def test_figures_do_not_depend_on_settings_of_the_working_folder(tmp_path: Path) -> None:
    draw = (
        "from unmodelled.report.figures import style as s\n"
        "with s.verbatim(), s.style():\n"
        "    f = s.new_figure(2.0)\n"
        "    f.subplots().set_title('$a_1$')\n"
        "print(s.svg(f).decode())\n"
    )
    plain = python("-c", draw, cwd=tmp_path)
    odd = "text.usetex: True\nsvg.fonttype: path\nlines.linewidth: 9\naxes.facecolor: red\n"
    (tmp_path / "matplotlibrc").write_text(odd)
    assert "$a_1$" in plain.stdout and python("-c", draw, cwd=tmp_path).stdout == plain.stdout
