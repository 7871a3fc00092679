"""`import unmodelled as um`: what it costs, what it offers, and what its examples are."""

import ast
import inspect
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import unmodelled as um
from pipeline.rigs.pendulum import PendulumCampaign
from tests import commands
from unmodelled.base.tables import read_table
from unmodelled.report.figures.tables import TEXTS

ROOT = Path(__file__).parents[2]
#: Libraries that the core neither loads nor needs.
FOREIGN = ("torch", "dvc", "hydra", "shap", "mujoco", "pyarrow")
#: Libraries that take long to load.
SLOW = (*FOREIGN, "numpy", "pandas", "scipy", "sympy", "numba", "matplotlib")

REFUSING = f"""
import sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {FOREIGN}:
            raise ModuleNotFoundError(f"{{name}} is not to be imported", name=name)
sys.meta_path.insert(0, Refuse())
"""


def python(program: str) -> str:
    """Standard output of a program that a new interpreter runs."""
    found = commands.python("-c", program)
    assert found.returncode == 0, found.stderr
    return found.stdout


def test_importing_the_package_loads_no_library() -> None:
    loaded = json.loads(python("import json, sys, unmodelled; print(json.dumps(sorted(sys.modules)))"))
    assert not {name.partition(".")[0] for name in loaded} & set(SLOW)
    assert [name for name in loaded if name.startswith("unmodelled")] == ["unmodelled"]


SAVE = """
import unmodelled as um
system, logs = um.example("pendulum")
simulation, study = um.simulate(system, logs), um.identifiability(system, logs)
answer = um.diagnose(system, logs)
simulation.save("{0}/simulation")
study.save("{0}/study")
answer.save("{0}/answer")
"""
SAY = """
simulation.plot()
answer.plot()
print(answer.verdict, answer.effects[0].family)
frames = dict(iter(logs.table().groupby("experiment")))
print((um.Logs.from_frames(frames, system).y == logs.y).all())
"""


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Folder of the results, and output, of a program that cannot load the optional libraries."""
    folder = tmp_path_factory.mktemp("core")
    return folder, python(REFUSING + SAVE.format(folder) + SAY)


@pytest.mark.long
def test_the_core_works_without_optional_libraries(core: tuple[Path, str]) -> None:
    assert core[1] == "effect coulomb_friction\nTrue\n"


@pytest.mark.long
def test_results_are_csv_files_without_pyarrow(core: tuple[Path, str], tmp_path: Path) -> None:
    without, normal = core[0], tmp_path
    python(SAVE.format(normal))
    written = sorted(path.relative_to(normal) for path in normal.rglob("*.parquet"))
    assert len(written) >= 11 and not list(without.rglob("*.parquet"))
    for path in written:
        one = read_table((normal / path).with_suffix(""), TEXTS)
        other = read_table((without / path).with_suffix(""), TEXTS)
        pd.testing.assert_frame_equal(one, other, check_dtype=len(one) > 0, rtol=0.0, atol=0.0)
    assert (without / "answer" / "index.html").exists()


@pytest.mark.long
@pytest.mark.parametrize("library", ["pyarrow", "torch"])
def test_a_missing_library_is_named_with_the_command_that_installs_it(library: str, tmp_path: Path) -> None:
    system, logs = um.example("pendulum")
    frames = dict(iter(logs.table().groupby("experiment")))
    folder = tmp_path / "logs"
    folder.mkdir()
    for name, rows in frames.items():
        rows.to_parquet(folder / f"{name}.parquet")
    table = [f"{name},{name}.parquet" for name in frames]
    (folder / "experiments.csv").write_text("\n".join(["id,file", *table]))
    verb, given = ("simulate", str(folder)) if library == "pyarrow" else ("train", logs.source)
    words = [verb, f"system={system.source}", f"logs={given}", f"out={tmp_path}/out"]
    program = REFUSING.replace(str(FOREIGN), str((library,)))
    program += f"sys.argv[1:] = {words}\nfrom unmodelled.__main__ import console\nconsole()"
    found = commands.python("-c", program, cwd=tmp_path)
    lines = found.stderr.splitlines()
    assert found.returncode == 2, found.stderr
    assert lines[0].startswith("error: ")
    assert all(f'{library} is not installed: pip install "{library}' in line for line in lines), found.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", FOREIGN)
def test_the_hook_of_that_test_refuses(name: str) -> None:
    with pytest.raises(AssertionError, match=f"{name} is not to be imported"):
        python(f"{REFUSING}import {name}")


def test_all_names_are_imported_for_type_checkers_from_where_they_are() -> None:
    tree = ast.parse((ROOT / "unmodelled" / "__init__.py").read_text())
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    named = {a.asname: node.module for node in imports for a in node.names if a.asname}
    assert sorted(named) == um.__all__ == dir(um)
    for name, module in named.items():
        assert getattr(um, name).__module__ == module, name


def test_a_name_that_is_not_there_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'diagnoze'"):
        um.diagnoze  # noqa: B018


@pytest.mark.parametrize("name", [n for n in um.__all__ if inspect.isfunction(getattr(um, n))])
def test_every_function_has_an_example(name: str) -> None:
    assert ">>> " in (getattr(um, name).__doc__ or "")


#: Of the example flywheel.
INERTIA, DAMPING, TORQUE = 0.5, 0.02, 2.0
#: Mean and standard deviation of the brake's torque, in nominal values; rms noise of the sensor, rad/s.
SCATTER, NOISE = (0.9, 0.1), 0.05
RUNS, SAMPLES, PERIOD, START = 24, 120, 0.1, 40.0


def write_flywheel(folder: Path) -> None:
    """Write the logs of the example flywheel, by the closed form of its motion."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(0)
    t = PERIOD * np.arange(SAMPLES)
    ids = [f"run{k + 1}" for k in range(RUNS)]
    for name in ids:
        torque = TORQUE * rng.normal(*SCATTER)
        final = torque / DAMPING
        omega = (START + final) * np.exp(-DAMPING * t / INERTIA) - final
        noisy = omega + rng.normal(0.0, NOISE, SAMPLES)
        log = pd.DataFrame({"t": t, "omega": noisy})
        log.to_csv(folder / f"{name}.csv", index=False, float_format="%.4f")
    listed = pd.DataFrame({"id": ids, "file": [f"{name}.csv" for name in ids]})
    listed.to_csv(folder / "experiments.csv", index=False)


def test_the_examples_are_what_their_benches_write(tmp_path: Path) -> None:
    PendulumCampaign(runs=4, duration=2.0, period=0.005).write(tmp_path / "pendulum", 0)
    write_flywheel(tmp_path / "flywheel")
    for name in ("pendulum", "flywheel"):
        shipped = ROOT / "unmodelled" / "api" / "examples" / name / "logs"
        for path in shipped.glob("*.csv"):
            old, new = pd.read_csv(path), pd.read_csv(tmp_path / name / path.name)
            pd.testing.assert_frame_equal(old, new, rtol=0.0, atol=1e-3)
    own = ROOT / "unmodelled" / "api" / "examples" / "pendulum" / "pendulum.yaml"
    assert own.read_text() == (ROOT / "systems" / "pendulum.yaml").read_text()
